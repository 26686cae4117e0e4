// SPDX-License-Identifier: Apache-2.0
// The number of threads changes how long clouds and maps take, and not a bit of them.
#include "base/threads.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "geometry/calibration_digest.hpp"
#include "map_codec/tile_codec.hpp"
#include "mapping/heights.hpp"
#include "mapping_pipeline/mapping_pipeline.hpp"
#include "recording/image_file.hpp"
#include "recording/recording.hpp"
#include "stereo/stereo_stage.hpp"
#include "temp_folder.hpp"

namespace crane {
namespace {

const Recording& rig() {
  static const Recording recording = *Recording::open(test::rig_recording());
  return recording;
}

/// All frames of the recording, matched.
std::vector<CloudSample> clouds_on(int threads) {
  use_threads(threads);
  StereoSettings settings;
  settings.threads = threads;
  auto stage = *StereoStage::create(rig().rig(), settings);
  const RectifiedCamera& camera = stage.camera();
  const std::size_t pixels = std::size_t(camera.width) * camera.height;
  std::vector<CloudSample> out;
  for (const RecordedFrame& frame : rig().frames()) {
    CloudSample c;
    c.calibration = calibration_digest(rig().rig());
    c.stream = 1;
    c.sequence_number = out.size();
    c.exposure_time = frame.time;
    c.depth_m.resize(pixels);
    c.confidence.resize(pixels);
    c.colour.resize(3 * pixels);
    c.R_camera_rectified = camera.R_camera_rectified;
    c.frame.width = camera.width;
    c.frame.height = camera.height;
    c.frame.f_px = camera.f_px;
    c.frame.cx_px = camera.cx_px;
    c.frame.cy_px = camera.cy_px;
    c.frame.baseline_m = camera.baseline_m;
    c.frame.sigma_disparity_px = 0.05;
    const auto left = *read_image(frame.left_file, pixels);
    const auto right = *read_image(frame.right_file, pixels);
    EXPECT_TRUE(stage.rectify({left.view(), right.view(), std::int64_t(out.size())}));
    EXPECT_TRUE(stage.match({c.depth_m, c.confidence, c.colour}));
    out.push_back(std::move(c));
  }
  return out;
}

/// The map's tiles, as they are published. `less_certain`: by so much the pair's disparities are
/// said to be worse.
std::vector<Bytes> map_on(int threads, const std::vector<CloudSample>& clouds,
                          double less_certain) {
  MapperConfig config;
  config.voxel_m = 0.02;
  config.threads = threads;
  MappingPipeline pipeline(config, rig().rig());
  for (const RecordedDistance& r : rig().cart())
    pipeline.add_position(Axis::kCart, 1, r.time, r.distance_m);
  for (const RecordedDistance& r : rig().trolley())
    pipeline.add_position(Axis::kTrolley, 1, r.time, r.distance_m);
  std::vector<Bytes> out;
  for (CloudSample cloud : clouds) {
    cloud.frame.sigma_disparity_px *= less_certain;
    const TimeNs time = cloud.exposure_time;
    pipeline.add_cloud(std::move(cloud), time);
    const auto report = pipeline.step(time);
    EXPECT_TRUE(report && !report->refused);
  }
  const OccupancyMap& map = pipeline.map();
  for (const Tile* tile : map.tiles()) {
    for (const int band : known_bands(*tile)) out.push_back(encode_tile(*tile, band));
    out.push_back(encode_heights(tile_heights(map, *tile, 0.03)));
  }
  return out;
}

TEST(Threads, CloudsAndMapsAreTheSameOnAnyNumber) {
  const std::vector<CloudSample> clouds = clouds_on(1);
  const std::vector<Bytes> sharp = map_on(1, clouds, 1), blurred = map_on(1, clouds, 10);
  ASSERT_GT(sharp.size(), 20U);
  EXPECT_NE(sharp, blurred);
  for (const int threads : {2, 3, 8}) {
    const std::vector<CloudSample> theirs = clouds_on(threads);
    for (std::size_t n = 0; n < clouds.size(); ++n) {
      EXPECT_EQ(clouds[n].depth_m, theirs[n].depth_m) << threads << " threads, frame " << n;
      EXPECT_EQ(clouds[n].confidence, theirs[n].confidence) << threads << " threads, frame " << n;
      EXPECT_EQ(clouds[n].colour, theirs[n].colour) << threads << " threads, frame " << n;
    }
    EXPECT_EQ(sharp, map_on(threads, clouds, 1)) << threads << " threads";
    EXPECT_EQ(blurred, map_on(threads, clouds, 10)) << threads << " threads";
  }
  use_threads(0);
}

}  // namespace
}  // namespace crane
