// SPDX-License-Identifier: Apache-2.0
#include "motion/key_frames.hpp"

#include <algorithm>

namespace crane {
namespace {

/// A kept image of the same place is replaced by a new one when it is so old.
constexpr TimeNs kRenew = 5 * kNsPerSecond;

double apart_m(const PlacedImage& a, const PlacedImage& b) {
  return (a.T_map_rectified.translation() - b.T_map_rectified.translation()).norm();
}

bool same_camera(const PlacedImage& a, const PlacedImage& b) {
  return a.full.width == b.full.width && a.full.height == b.full.height && a.f_px == b.f_px &&
         a.cx_px == b.cx_px && a.cy_px == b.cy_px &&
         a.T_map_rectified.linear().isApprox(b.T_map_rectified.linear(), 1e-9);
}

}  // namespace

void KeyFrames::add(PlacedImage image) {
  std::erase_if(kept_, [&](const auto& kept) {
    return !same_camera(*kept, image) || kept->exposure >= image.exposure ||
           image.exposure - kept->exposure > settings_.oldest;
  });
  const auto near = std::find_if(kept_.begin(), kept_.end(), [&](const auto& kept) {
    return apart_m(*kept, image) < settings_.spacing_m;
  });
  if (near != kept_.end()) {
    if (image.exposure - (*near)->exposure < kRenew) return;
    kept_.erase(near);
  }
  if (kept_.size() >= settings_.most) kept_.pop_back();
  kept_.insert(kept_.begin(), std::make_shared<const PlacedImage>(std::move(image)));
}

std::size_t KeyFrames::memory_bytes() const {
  std::size_t bytes = 0;
  for (const auto& kept : kept_)
    bytes += kept->full.pixels.capacity() + kept->half.pixels.capacity() +
             kept->contrast.pixels.capacity() + sizeof(PlacedImage);
  return bytes;
}

}  // namespace crane
