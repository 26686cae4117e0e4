// SPDX-License-Identifier: Apache-2.0
#include "geometry/calibration_digest.hpp"

#include <cmath>

namespace crane {
namespace {

/// FNV-1a over numbers rounded to 1e-9, byte by byte from the low one: the same on every machine.
class Digest {
 public:
  void add(double value) {
    const auto rounded = static_cast<std::uint64_t>(std::llround(value * 1e9));
    for (unsigned shift = 0; shift < 64; shift += 8)
      hash_ = (hash_ ^ (rounded >> shift & 0xFFU)) * 0x100000001B3ULL;
  }
  void add(const CameraModel& c) {
    for (const double v : {double(c.width), double(c.height), c.fx_px, c.fy_px, c.cx_px, c.cy_px,
                           c.k1, c.k2, c.p1, c.p2, double(c.lens), c.k3, c.k4, c.k5, c.k6})
      add(v);
  }
  void add(const Eigen::Isometry3d& T) {
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 4; ++c) add(T.matrix()(r, c));
  }
  [[nodiscard]] std::uint64_t value() const { return hash_ == 0 ? 1 : hash_; }

 private:
  std::uint64_t hash_ = 0xCBF29CE484222325ULL;
};

}  // namespace

std::uint64_t calibration_digest(const StereoRig& rig) {
  Digest digest;
  digest.add(rig.left);
  digest.add(rig.right);
  digest.add(rig.T_right_left());
  digest.add(rig.T_map_camera_at_zero);
  return digest.value();
}

}  // namespace crane
