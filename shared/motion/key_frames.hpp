// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "motion/placed_image.hpp"

namespace crane {

struct KeyFrameSettings {
  std::size_t most = 12;   ///< kept; each 1.5 bytes a pixel
  double spacing_m = 0.3;  ///< a frame nearer to a kept one takes its place, once that is old
  TimeNs oldest = 60 * kNsPerSecond;  ///< light and things change
};

/// A few images of where the camera was lately, spread over the way it came. Bounded: at 1280 x 720
/// twelve are 17 MB. While the crane stands nothing is added but one image after kRenew. One
/// thread.
class KeyFrames {
 public:
  explicit KeyFrames(const KeyFrameSettings& settings) : settings_(settings) {}

  /// Keeps the image if it tells more than those that are kept. What is of another time than this
  /// one, or another camera, is forgotten.
  void add(PlacedImage image);
  /// Newest first, none older than settings.oldest.
  [[nodiscard]] const std::vector<std::shared_ptr<const PlacedImage>>& all() const { return kept_; }
  void clear() { kept_.clear(); }
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  KeyFrameSettings settings_;
  std::vector<std::shared_ptr<const PlacedImage>> kept_;
};

}  // namespace crane
