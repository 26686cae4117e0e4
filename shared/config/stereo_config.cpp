// SPDX-License-Identifier: Apache-2.0
#include "config/stereo_config.hpp"

#include "config/key.hpp"
#include "config/yaml_reader.hpp"

namespace crane {

void keys(KeyVisitor& v, StereoConfig& c) {
  v.choice({"preset", "paper: the paper's parameters, eq. 10 disparities and full search"}, c.paper,
           {"default", "paper"});
  v.choice({"matcher", "semi-global, or OpenCV's block matcher or SGBM"}, c.matcher,
           {"sgm", "bm", "sgbm"});
  v.integer({"block_px", "edge of what is matched"}, c.block_px, {5, 21, kOdd});
  v.integer({"speckle_window_px", "smaller patches of disparity are dropped; 0: none"},
            c.speckle_window_px, {0, 10'000});
  v.integer({"uniqueness_percent", "so much better than the next must a match be"},
            c.uniqueness_percent, {0, 50});
  v.integer({"left_right_px", "largest disagreement of left and right match; -1: no check"},
            c.left_right_px, {-1, 16});
  v.number(Key("nearest_m",
               "depth from which all is searched in full; what is nearer, to 0.2 camera heights, "
               "at a quarter of the resolution, and else stays unknown")
               .by_default("0: 0.52 camera heights"),
           c.nearest_m, {0, 200});
  v.number(Key("farthest_m", "depth up to which is searched").by_default("0: 1.15 camera heights"),
           c.farthest_m, {0, 200});
  v.number({"sigma_disparity_px", "standard deviation of a match of confidence 255"},
           c.sigma_disparity_px, {0.01, 10});
  v.integer(Key("threads", "of the machine that match; the result is the same for any number")
                .by_default("0: all, at most 4"),
            c.threads, {0, 8});
  YamlReader* y = v.reading();
  if (y != nullptr && c.nearest_m > 0 && c.farthest_m > 0 && c.nearest_m >= c.farthest_m)
    y->problem("nearest_m", "must be less than farthest_m");
}

}  // namespace crane
