// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace crane {

class KeyVisitor;

/// Section `stereo`.
struct StereoConfig {
  enum class Matcher { kSgm, kBlock, kSgbm };
  Matcher matcher = Matcher::kSgm;
  bool paper = false;
  int block_px = 9;
  int speckle_window_px = 100;
  int uniqueness_percent = 15;
  int left_right_px = 1;
  double nearest_m = 0, farthest_m = 0;
  double sigma_disparity_px = 0.05;
  int threads = 0;
};
void keys(KeyVisitor& v, StereoConfig& c);

}  // namespace crane
