// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace crane {

class KeyVisitor;

/// Section `mapper`.
struct MapperConfig {
  enum class Method { kDefault, kPaper };
  Method method = Method::kDefault;
  double voxel_m = 0;
  double z_min_m = -0.3;
  double z_max_m = 0;
  int max_position_gap_ms = 200;
  int position_wait_ms = 1000;
  // Of the rangefinders.
  int cart_latency_ms = 0, trolley_latency_ms = 0;
  double rangefinder_min_m = 0.05, rangefinder_max_m = 1000;
  double rangefinder_noise_m = 0.03;
  double largest_speed_mps = 3;
  int cart_direction = 1, trolley_direction = 1;
  double cart_offset_m = 0, trolley_offset_m = 0;
  // Two of the cart, one a rail, tell how skew the bridge is.
  double rail_y_m = 0, rail_span_m = 0;
  int cart_second_direction = 1, cart_second_latency_ms = 0;
  double cart_second_offset_m = 0;
  double largest_skew_deg = 2;
  // Of the map.
  double publish_hz = 20;
  double octree_hz = 1;
  int stale_ms = 2000;
  double forget_s = 3600;
  int max_memory_mib = 4096;
  int threads = 0;
  // method: paper
  int outlier_neighbours = 50;
  double outlier_std = 1.0;
  double leaf_m = 0.01;
  bool outliers_first = false;
};
void keys(KeyVisitor& v, MapperConfig& c);

}  // namespace crane
