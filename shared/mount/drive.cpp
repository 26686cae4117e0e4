// SPDX-License-Identifier: Apache-2.0
#include "mount/drive.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "imaging/convert.hpp"
#include "recording/image_file.hpp"
#include "stereo/rectification.hpp"

namespace crane {
namespace {

constexpr std::size_t kMostFrames = 400;
constexpr int kMostPoints = 350;                       ///< in one image
constexpr double kQuality = 0.01;                      ///< of a corner, against the best one
constexpr int kMargin = 12;                            ///< to the image's edge [px]
constexpr float kThereAndBack = 0.3F, kOffRow = 1.0F;  ///< [px]
constexpr int kLevels = 5, kWindow = 21;
constexpr std::size_t kLongest = 40;  ///< sightings of one track: what drifts away is begun anew

using Points = std::vector<cv::Point2f>;
using Pyramid = std::vector<cv::Mat>;

struct Eyes {
  cv::Mat left;
  Pyramid left_pyramid, right_pyramid;
};

/// Where points of one image are in another, to and back again; what does not come back is not ok.
std::vector<bool> follow(const Pyramid& from, const Pyramid& to, const Points& points,
                         Points& found) {
  const cv::TermCriteria until(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 30, 0.003);
  const cv::Size window(kWindow, kWindow);
  std::vector<std::uint8_t> there, back;
  std::vector<float> error;
  Points returned = points;
  std::vector<bool> ok(points.size(), false);
  if (points.empty()) return ok;
  const bool guessed = found.size() == points.size();
  cv::calcOpticalFlowPyrLK(from, to, points, found, there, error, window, kLevels, until,
                           guessed ? cv::OPTFLOW_USE_INITIAL_FLOW : 0, 1e-3);
  cv::calcOpticalFlowPyrLK(to, from, found, returned, back, error, window, kLevels, until,
                           cv::OPTFLOW_USE_INITIAL_FLOW, 1e-3);
  for (std::size_t i = 0; i < points.size(); ++i)
    ok[i] = there[i] != 0 && back[i] != 0 && cv::norm(returned[i] - points[i]) < kThereAndBack;
  return ok;
}

class Tracker {
 public:
  Tracker(const StereoRig& rig, Rectification rectification)
      : rig_(rig), rectification_(std::move(rectification)) {}

  /// Error: of an image file.
  Result<DriveFrame> look(const RecordedFrame& frame) {
    DriveFrame out;
    out.time = frame.time;
    Eyes eyes;
    for (const bool left : {true, false})
      if (auto r = read(left ? frame.left_file : frame.right_file, left, eyes); !r)
        return r.error();
    if (!before_.left.empty()) go_on(eyes);
    if (points_.size() < 3 * std::size_t(kMostPoints) / 4) find_new(eyes.left);
    sight(eyes, out);
    before_ = std::move(eyes);
    return out;
  }
  [[nodiscard]] std::size_t tracks() const { return next_; }

 private:
  Result<void> read(const std::string& path, bool left, Eyes& eyes) {
    const CameraModel& camera = left ? rig_.left : rig_.right;
    const auto image = read_image(path, std::uint64_t(camera.width) * camera.height, camera.bits);
    if (!image) return image.error();
    if (image->width != camera.width || image->height != camera.height)
      return Error{ErrorCode::kBadData, path, "has another size than its calibration says",
                   "record with the camera that was calibrated"};
    std::vector<std::uint8_t> grey;
    if (auto r = to_grey(image->view(), grey); !r) return r;
    const cv::Mat raw(int(image->height), int(image->width), CV_8UC1, grey.data());
    cv::Mat level;
    const cv::Mat* maps = left ? rectification_.left : rectification_.right;
    cv::remap(raw, level, maps[0], maps[1], cv::INTER_LINEAR);
    cv::buildOpticalFlowPyramid(level, left ? eyes.left_pyramid : eyes.right_pyramid,
                                {kWindow, kWindow}, kLevels);
    if (left) eyes.left = level;
    return {};
  }

  /// Points of the image before, in this one.
  void go_on(const Eyes& eyes) {
    Points found;
    for (const cv::Point2f& p : points_) found.push_back(p + last_flow_);
    const std::vector<bool> ok = follow(before_.left_pyramid, eyes.left_pyramid, points_, found);
    std::size_t kept = 0;
    std::vector<float> du, dv;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      if (!ok[i] || !inside(found[i], eyes.left) || length_[i] >= kLongest) continue;
      du.push_back(found[i].x - points_[i].x), dv.push_back(found[i].y - points_[i].y);
      points_[kept] = found[i];
      numbers_[kept] = numbers_[i];
      disparities_[kept] = disparities_[i];
      length_[kept++] = length_[i];
    }
    shrink(kept);
    last_flow_ = {};
    if (du.empty()) return;
    const auto middle = std::ptrdiff_t(du.size() / 2);
    std::nth_element(du.begin(), du.begin() + middle, du.end());
    std::nth_element(dv.begin(), dv.begin() + middle, dv.end());
    last_flow_ = {du[std::size_t(middle)], dv[std::size_t(middle)]};
  }

  void shrink(std::size_t kept) {
    points_.resize(kept), numbers_.resize(kept), length_.resize(kept), disparities_.resize(kept);
  }

  void find_new(const cv::Mat& image) {
    cv::Mat free(image.size(), CV_8UC1, cv::Scalar(0));
    free(cv::Rect(kMargin, kMargin, image.cols - 2 * kMargin, image.rows - 2 * kMargin)) = 255;
    const int apart = std::max(8, image.cols / 45);
    for (const cv::Point2f& p : points_) cv::circle(free, p, apart, 0, cv::FILLED);
    Points fresh;
    cv::goodFeaturesToTrack(image, fresh, kMostPoints - int(points_.size()), kQuality, apart, free,
                            7);
    for (const cv::Point2f& p : fresh) {
      points_.push_back(p);
      numbers_.push_back(next_++);
      length_.push_back(0);
      disparities_.push_back(usual_disparity_);
    }
  }

  /// The same points in the right image.
  void sight(const Eyes& eyes, DriveFrame& out) {
    Points right;
    for (std::size_t i = 0; i < points_.size(); ++i)
      right.emplace_back(points_[i].x - disparities_[i], points_[i].y);
    const std::vector<bool> ok = follow(eyes.left_pyramid, eyes.right_pyramid, points_, right);
    std::size_t kept = 0;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const float disparity = points_[i].x - right[i].x;
      if (!ok[i] || !inside(right[i], eyes.left) || std::abs(right[i].y - points_[i].y) > kOffRow ||
          disparity < 1)
        continue;
      points_[kept] = points_[i];
      numbers_[kept] = numbers_[i];
      disparities_[kept] = disparity;
      length_[kept++] = length_[i] + 1;
      out.sightings.push_back(
          {numbers_[kept - 1], points_[kept - 1].x, points_[kept - 1].y, double(right[i].x)});
    }
    shrink(kept);
  }

  static bool inside(const cv::Point2f& p, const cv::Mat& image) {
    return p.x > kMargin && p.y > kMargin && p.x < float(image.cols - kMargin) &&
           p.y < float(image.rows - kMargin);
  }

  StereoRig rig_;
  Rectification rectification_;
  float usual_disparity_ = 0;
  Eyes before_;
  Points points_;
  cv::Point2f last_flow_;
  std::vector<std::size_t> numbers_, length_;
  std::vector<float> disparities_;
  std::size_t next_ = 0;

 public:
  void expect_disparity(double px) { usual_disparity_ = float(px); }
};

}  // namespace

Result<Drive> read_drive(const Recording& recording, const StereoRig& rig,
                         const std::function<bool(std::size_t, std::size_t)>& progress) {
  Drive drive;
  drive.rig = rig;
  auto rectification = rectification_of(drive.rig);
  if (!rectification) return rectification.error();
  drive.camera = rectification->camera;
  drive.cart = recording.cart();
  drive.cart_second = recording.cart_second();
  drive.trolley = recording.trolley();
  drive.hoist = recording.hoist();
  drive.told_height_m = drive.rig.camera_height_m();
  drive.recorded_frames = recording.frames().size();
  const std::size_t stride = (drive.recorded_frames + kMostFrames - 1) / kMostFrames;
  Tracker tracker(drive.rig, std::move(*rectification));
  tracker.expect_disparity(drive.camera.f_px * drive.camera.baseline_m /
                           std::max(0.1, drive.told_height_m));
  for (std::size_t i = 0; i < drive.recorded_frames; i += stride) {
    auto frame = tracker.look(recording.frames()[i]);
    if (!frame) return frame.error();
    drive.frames.push_back(std::move(*frame));
    if (progress && !progress(i + 1, drive.recorded_frames))
      return Error{ErrorCode::kNotAvailable, recording.folder(), "stopped before the end", ""};
  }
  drive.tracks = tracker.tracks();
  return drive;
}

}  // namespace crane
