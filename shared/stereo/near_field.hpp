// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "stereo/semi_global.hpp"

namespace crane {

/// Disparities of the full images [px].
struct NearFieldRange {
  int first_px = 0, last_px = 0;  ///< what the full images are searched for
  int nearest_px = 0;             ///< up to here the small ones are
};

struct NearFieldReport {
  std::uint32_t matched = 0;   ///< pixels of the full images whose match is nearer than the search
  std::uint32_t too_near = 0;  ///< pixels at the near end of this search as well: no match
};

/// What stands nearer to the camera than the search of the full images, found in images of a
/// quarter of their width and height: a sixteenth of the pixels, a quarter of the disparities. Near
/// things are large, and a pixel of disparity is a short way there. Without it such a thing would
/// be unmatched at best, and take the match of something else at worst.
class NearField {
 public:
  /// nullopt: the images are too small, or nothing nearer is left to search.
  /// `threads`: as SemiGlobalSettings::threads.
  static std::optional<NearField> create(int width, int height, const NearFieldRange& range,
                                         int threads = 0);
  ~NearField();
  NearField(NearField&&) noexcept;
  NearField& operator=(NearField&&) noexcept;

  /// Puts what is near into `disparity` and `confidence` of the full images, and drops the matches
  /// right beside it.
  NearFieldReport apply(const GreyView& left, const GreyView& right,
                        std::span<std::int16_t> disparity, std::span<std::uint8_t> confidence);

 private:
  struct Impl;
  explicit NearField(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace crane
