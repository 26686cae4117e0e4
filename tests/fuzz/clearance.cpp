// SPDX-License-Identifier: Apache-2.0
// Clearance queries of any numbers, to a small map with zones: refused, or answered within the
// bound of what one may cost, and what is called clear stays so at every height that is said to be
// clear.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>

#include "client/voxel_map.hpp"

namespace {

using namespace crane::client;

/// Numbers out of bytes: any double at all, or a sensible length.
class Numbers {
 public:
  Numbers(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}
  double next() {
    const std::uint8_t kind = byte();
    if (kind % 8 == 0) {
      std::uint64_t bits = 0;
      for (int i = 0; i < 8; ++i) bits = bits << 8U | byte();
      double any = 0;
      std::memcpy(&any, &bits, sizeof any);
      return any;
    }
    const int raw = byte() << 8 | byte();
    return kind % 8 == 1 ? raw : (raw - 20'000) * 1e-4;
  }
  std::uint8_t byte() { return at_ < size_ ? data_[at_++] : 0; }

 private:
  const std::uint8_t* data_;
  std::size_t size_, at_ = 0;
};

const VoxelMap& small_map() {
  static const VoxelMap map = [] {
    VoxelMap m(0.05, 3);
    for (int x = -50; x < 50; ++x)
      for (int y = -40; y < 40; ++y)
        for (int z = 0; z < 60; ++z)
          m.set(x, y, z,
                z == 0 || (x > 10 && x < 16 && z < 20) ? crane::Occupancy::kOccupied
                : x < -45 && z > 30                    ? crane::Occupancy::kUnknown
                                                       : crane::Occupancy::kFree);
    return m;
  }();
  return map;
}

void demand(bool holds) {
  if (!holds) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Numbers numbers(data, size);
  ClearanceQuery q;
  const int poses = numbers.byte() % 5;
  for (int i = 0; i < poses; ++i) {
    Pose p;
    p.x_m = numbers.next();
    p.y_m = numbers.next();
    p.z_m = i > 0 && numbers.byte() % 2 == 0 ? q.path[0].z_m : numbers.next();
    p.yaw_rad = numbers.next();
    q.path.push_back(p);
  }
  q.load = {std::abs(numbers.next()), std::abs(numbers.next()), std::abs(numbers.next()),
            numbers.byte() % 2 == 0 ? kToRopeTop : std::abs(numbers.next())};
  q.margins = {std::abs(numbers.next()), std::abs(numbers.next()), std::abs(numbers.next()),
               std::abs(numbers.next())};
  if (numbers.byte() % 4 == 0) q.max_age_s = numbers.next();
  std::vector<Zone> zones(numbers.byte() % 3);
  for (Zone& z : zones) {
    z.id = 1;
    z.active = true;
    z.kind = numbers.byte() % 2 == 0 ? Zone::Kind::kNoGo : Zone::Kind::kSlowDown;
    z.z_min_m = std::clamp(numbers.next(), -100.0, 100.0);
    z.z_max_m = z.z_min_m + 1;
    for (int i = 0; i < 3; ++i)
      z.corners.push_back(
          {std::clamp(numbers.next(), -9e4, 9e4), std::clamp(numbers.next(), -9e4, 9e4)});
  }
  static VoxelMap map = small_map();
  ColumnView view = map.view();
  view.zones = &zones;
  const Clearance answer = check_clearance(q, view, 1'000'000'000);
  demand(answer.columns <= 4'000'000);
  if (answer.verdict == Verdict::kInvalid) {
    demand(!answer.text.empty() && std::isnan(answer.safe_height_m));
    return 0;
  }
  double asked = q.path[0].z_m;
  for (const Pose& p : q.path) asked = std::max(asked, p.z_m);
  if (std::isnan(answer.safe_height_m)) return 0;
  demand(answer.safe_height_m >= asked && answer.safe_low_m <= answer.safe_height_m &&
         answer.safe_height_m <= answer.safe_high_m);
  for (Pose& p : q.path) p.z_m = answer.safe_height_m;
  demand(check_clearance(q, view, 1'000'000'000).verdict == Verdict::kClear);
  return 0;
}
