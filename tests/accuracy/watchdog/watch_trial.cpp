// SPDX-License-Identifier: Apache-2.0
#include "watch_trial.hpp"

#include "geometry/calibration_digest.hpp"
#include "recording/image_file.hpp"
#include "stereo/stereo_stage.hpp"

namespace crane::accuracy {

Result<WatchOutcome> watch(const Recording& recording, const std::vector<Fault>& faults,
                           const std::function<void(std::size_t, const MappingPipeline&)>& tell,
                           bool skew, MapperConfig config) {
  const StereoRig rig = told_rig(recording.rig(), faults);
  auto stage = StereoStage::create(rig, {});
  if (!stage) return stage.error();
  config.voxel_m = 0.05;
  config.rangefinder_min_m = -1000;
  skew = skew && !recording.cart_second().empty();
  if (skew) {
    const auto site = read_site_config(recording.folder() + "/site.yaml");
    if (!site) return site.error();
    config.rail_y_m = site->mapper.rail_y_m;
    config.rail_span_m = site->mapper.rail_span_m;
  }
  MappingPipeline pipeline(config, rig);
  if (skew)
    for (const RecordedDistance& r : recording.cart_second())
      pipeline.add_position(Axis::kCartSecond, 1, r.time, r.distance_m);
  const auto& frames = recording.frames();
  for (const Axis axis : {Axis::kCart, Axis::kTrolley}) {
    std::vector<RecordedDistance> readings =
        axis == Axis::kCart ? recording.cart() : recording.trolley();
    spoil(readings, faults, axis == Axis::kCart, frames[frames.size() / 2].time);
    for (const RecordedDistance& r : readings) pipeline.add_position(axis, 1, r.time, r.distance_m);
  }
  const RectifiedCamera& camera = stage->camera();
  const std::size_t pixels = std::size_t(camera.width) * camera.height;
  WatchOutcome out;
  double watch_ms = 0;
  for (std::size_t n = 0; n < frames.size(); ++n) {
    auto left = read_image(frames[n].left_file, pixels, rig.left.bits);
    if (!left) return left.error();
    auto right = read_image(frames[n].right_file, pixels, rig.right.bits);
    if (!right) return right.error();
    CloudSample cloud;
    cloud.calibration = calibration_digest(rig);
    cloud.stream = 1;
    cloud.sequence_number = n;
    cloud.exposure_time = frames[n].time;
    cloud.depth_m.resize(pixels);
    cloud.confidence.resize(pixels);
    cloud.colour.resize(3 * pixels);
    cloud.R_camera_rectified = camera.R_camera_rectified;
    cloud.frame.width = camera.width;
    cloud.frame.height = camera.height;
    cloud.frame.f_px = camera.f_px;
    cloud.frame.cx_px = camera.cx_px;
    cloud.frame.cy_px = camera.cy_px;
    cloud.frame.baseline_m = camera.baseline_m;
    cloud.frame.sigma_disparity_px = StereoConfig{}.sigma_disparity_px;
    auto rectified = stage->rectify({left->view(), right->view(), static_cast<int>(n)});
    if (!rectified) return rectified.error();
    auto matched = stage->match({cloud.depth_m, cloud.confidence, cloud.colour});
    if (!matched) return matched.error();
    cloud.rows = matched->rows;
    pipeline.add_cloud(std::move(cloud), frames[n].time);
    const auto report = pipeline.step(frames[n].time + 10 * kNsPerSecond);
    if (report)
      for (const StageMs& s : report->stages)
        if (s.stage == std::string("watch")) watch_ms += s.ms;
    const PipelineReport said = pipeline.report();
    if (said.watch == WatchState::kDrifting && out.drifting_after < 0)
      out.drifting_after = static_cast<int>(n);
    if (said.watch == WatchState::kWrong && out.wrong_after < 0) {
      out.wrong_after = static_cast<int>(n);
      out.wrong_after_s = double(frames[n].time - frames[0].time) * 1e-9;
    }
    if (tell) tell(n, pipeline);
  }
  const PipelineReport said = pipeline.report();
  out.state = said.watch;
  out.misfit = said.misfit;
  out.frames = frames.size();
  out.used = said.account.integrated;
  out.watch_ms = watch_ms / double(std::max<std::size_t>(1, frames.size()));
  return out;
}

}  // namespace crane::accuracy
