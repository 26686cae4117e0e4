// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "base/clock.hpp"
#include "geometry/calibration_digest.hpp"
#include "mapper/map_store.hpp"
#include "mapping_pipeline/mapping_pipeline.hpp"
#include "recording/recording.hpp"
#include "temp_folder.hpp"

namespace crane {

constexpr TimeNs kMs = 1'000'000;
constexpr TimeNs kT0 = 1'000 * kNsPerSecond;

/// A pipeline for the rig, and clouds of a bare floor for it.
class MappingPipelineTest : public ::testing::Test {
 protected:
  MappingPipelineTest() : rig_(the_rig()), builder_(config(), rig_) {}

  static const StereoRig& the_rig() {
    static const StereoRig rig = Recording::open(test::rig_recording())->rig();
    return rig;
  }

  static MapperConfig config() {
    MapperConfig c;
    c.voxel_m = 0.05;
    c.rangefinder_min_m = 0;
    c.rangefinder_max_m = 40;
    c.largest_speed_mps = 30;
    return c;
  }
  /// A floor seen at 1.95 m.
  static CloudSample cloud(std::uint64_t number, TimeNs exposure, std::uint64_t stream = 1) {
    CloudSample c;
    c.calibration = calibration_digest(the_rig());
    c.stream = stream;
    c.sequence_number = number;
    c.exposure_time = exposure;
    c.frame.width = 160;
    c.frame.height = 90;
    c.frame.f_px = 87.5;
    c.frame.cx_px = 79.5;
    c.frame.cy_px = 44.5;
    c.frame.baseline_m = 0.12;
    c.frame.sigma_disparity_px = 0.05;
    c.depth_m.assign(160 * 90, 1.95F);
    c.confidence.assign(160 * 90, 255);
    return c;
  }
  void save_one_frame(const std::string& state) {
    positions(kT0, kT0 + 2 * kNsPerSecond);
    builder_.add_cloud(cloud(0, kT0 + kNsPerSecond), kT0 + kNsPerSecond);
    ASSERT_TRUE(builder_.step(kT0 + kNsPerSecond));
    MapStore store(state);
    store.note_changes(builder_);
    ASSERT_TRUE(store.save(builder_, {true, 1, builder_.account()}));
    ASSERT_TRUE(store.finish());
  }
  void positions(TimeNs from, TimeNs to, TimeNs step = 50 * kMs) {
    for (TimeNs t = from; t <= to; t += step) {
      builder_.add_position(Axis::kCart, 9, t, 1.0);
      builder_.add_position(Axis::kTrolley, 9, t, 2.0);
    }
  }
  std::uint64_t dropped(Cause cause) { return builder_.report().counts.of(cause); }

  /// The floor lies on the border of two voxels.
  static Occupancy floor_at(const OccupancyMap& map, double x_m, double y_m) {
    const Occupancy above = map.at(map.index(x_m), map.index(y_m), 0);
    return above != Occupancy::kUnknown ? above : map.at(map.index(x_m), map.index(y_m), -1);
  }

  StereoRig rig_;
  MappingPipeline builder_;
  FakeClock clock_{kT0};
};

}  // namespace crane
