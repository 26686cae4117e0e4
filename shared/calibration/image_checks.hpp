// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "imaging/image.hpp"

namespace crane {

/// One thing that images of a pair of cameras show of how they were mounted.
struct ImageFinding {
  bool bad = false;
  std::string what;    ///< what was looked at: "light", "focus", ...
  std::string text;    ///< what was found
  std::string advice;  ///< what to do; empty when good
};

struct ImagePairView {
  const Image* left = nullptr;
  const Image* right = nullptr;
};

/// Looks at a few pairs of the floor: lens caps, light, exposure, focus, dirt on the glass, cables
/// swapped. At least one pair, all of one size. What rests on texture says so where there is none.
std::vector<ImageFinding> examine_images(const std::vector<ImagePairView>& pairs);

}  // namespace crane
