// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"

namespace crane {

/// Files of one stereo pair; one of both may be "": that camera has no image of this name.
struct ImagePair {
  std::string name, left, right;
};

/// The image pairs of a folder, by name: leftNAME and rightNAME, left/NAME and right/NAME, or
/// cam0/data/NAME and cam1/data/NAME (a recording).
/// Error: Configuration for a folder without any.
Result<std::vector<ImagePair>> find_image_pairs(const std::string& folder);

}  // namespace crane
