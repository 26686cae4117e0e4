// SPDX-License-Identifier: Apache-2.0
#include "config/mapper_config.hpp"

#include <cmath>

#include "config/key.hpp"
#include "config/yaml_reader.hpp"

namespace crane {
namespace {

constexpr Rule kAutomaticOr5mm{"0 (automatic) or at least 0.005",
                               [](double v) { return v == 0 || v >= 0.005; }};
constexpr Rule kNeverOr1s{"0 (never) or at least 1", [](double v) { return v == 0 || v >= 1; }};
constexpr Rule kOneOrASpan{"0 (one rangefinder), or at least 0.5 to either side",
                           [](double v) { return v == 0 || std::abs(v) >= 0.5; }};

/// What readings of cart and trolley mean.
void positions(KeyVisitor& v, MapperConfig& c) {
  v.integer({"max_position_gap_ms", "longest time between two readings of one rangefinder"},
            c.max_position_gap_ms, {1, 60'000});
  v.integer({"position_wait_ms", "for the reading after the exposure to arrive"},
            c.position_wait_ms, {0, 60'000});
  v.integer({"cart_latency_ms", "subtracted from its rangefinder's times"}, c.cart_latency_ms,
            {-1000, 1000});
  v.integer({"trolley_latency_ms", "subtracted from its rangefinder's times"}, c.trolley_latency_ms,
            {-1000, 1000});
  v.number({"rangefinder_min_m",
            "least reading, as measured, that is believed: an interrupted beam reads 0"},
           c.rangefinder_min_m, {-1000, 1000});
  v.number({"rangefinder_max_m", "largest reading that is believed"}, c.rangefinder_max_m,
           {-1000, 1000});
  v.number({"rangefinder_noise_m", "two readings of one place differ by less"},
           c.rangefinder_noise_m, {0.001, 1});
  v.number({"largest_speed_mps", "of cart and trolley: what is faster is a jump, not believed"},
           c.largest_speed_mps, {0.05, 100});
  v.integer({"cart_direction",
             "map coordinate = offset + direction x reading; -1: the device stands at the far end"},
            c.cart_direction, {-1, 1, kOneOrMinusOne});
  v.integer({"trolley_direction", "likewise"}, c.trolley_direction, {-1, 1, kOneOrMinusOne});
  v.number({"cart_offset_m", "map coordinate of a reading of 0"}, c.cart_offset_m,
           {-10'000, 10'000});
  v.number({"trolley_offset_m", "likewise"}, c.trolley_offset_m, {-10'000, 10'000});
  v.number({"rail_y_m", "map y of the first of two rangefinders of the cart, one a rail"},
           c.rail_y_m, {-10'000, 10'000});
  v.number({"rail_span_m", "the second stands so much further in y; 0: there is one"},
           c.rail_span_m, {-200, 200, kOneOrASpan});
  v.integer({"cart_second_direction", "as cart_direction, of the second"}, c.cart_second_direction,
            {-1, 1, kOneOrMinusOne});
  v.integer({"cart_second_latency_ms", "as cart_latency_ms, of the second"},
            c.cart_second_latency_ms, {-1000, 1000});
  v.number({"cart_second_offset_m", "as cart_offset_m, of the second"}, c.cart_second_offset_m,
           {-10'000, 10'000});
  v.number({"largest_skew_deg", "by more no bridge turns: then one of both is wrong"},
           c.largest_skew_deg, {0.05, 20});
  YamlReader* y = v.reading();
  if (y != nullptr && c.rangefinder_min_m >= c.rangefinder_max_m)
    y->problem("rangefinder_min_m", "must be less than rangefinder_max_m");
}

void paper(KeyVisitor& v, MapperConfig& c) {
  v.integer({"outlier_neighbours", "method: paper: of the outlier removal; 50 or 60 in the paper"},
            c.outlier_neighbours, {2, 1000});
  v.number(Key("outlier_std", "method: paper: standard deviations; 1.0 or 0.8 in the paper"),
           c.outlier_std, {0.01, 100});
  v.number({"leaf_m", "method: paper: of the voxel grid filter"}, c.leaf_m, {0.001, 1});
  v.flag({"outliers_first",
          "method: paper: before the voxel grid; the grid first is the paper's speed"},
         c.outliers_first);
}

}  // namespace

void keys(KeyVisitor& v, MapperConfig& c) {
  v.choice({"method", "paper: accumulate, outlier removal, voxel grid, octree"}, c.method,
           {"default", "paper"});
  v.number(Key("voxel_m", "edge of a voxel")
               .by_default("0: 0.05, or with method: paper 0.1 camera heights (eq. 9)"),
           c.voxel_m, {0, 2, kAutomaticOr5mm});
  v.number({"z_min_m", "lowest mapped height"}, c.z_min_m, {-20, 20});
  v.number(Key("z_max_m",
               "highest mapped height: up to it, or the rope's top, clearance asks what is above "
               "a load")
               .by_default("0: just below the camera"),
           c.z_max_m, {0, 100});
  positions(v, c);
  v.number({"publish_hz", "of changed tiles"}, c.publish_hz, {0.1, 20});
  v.number({"octree_hz", "of the whole octree, when it changed"}, c.octree_hz, {0.01, 5});
  v.integer({"stale_ms", "no cloud for longer: the map says so"}, c.stale_ms, {100, 600'000});
  v.number({"forget_s", "what is not seen again for so long is unknown; 0: never"}, c.forget_s,
           {0, 1e7, kNeverOr1s});
  v.integer({"max_memory_mib", "of the map"}, c.max_memory_mib, {64, 1'000'000});
  v.integer(Key("threads", "of the machine that map; the map is the same for any number")
                .by_default("0: all, at most 4"),
            c.threads, {0, 8});
  paper(v, c);
}

}  // namespace crane
