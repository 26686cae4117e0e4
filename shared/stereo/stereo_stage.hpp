// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "base/result.hpp"
#include "geometry/stereo_rig.hpp"
#include "imaging/convert.hpp"
#include "stereo/pair_check.hpp"

namespace crane {

/// How two images become depth.
struct StereoSettings {
  enum class Matcher {
    kSgm,    ///< SemiGlobalMatcher
    kBlock,  ///< OpenCV's StereoBM
    kSgbm,   ///< OpenCV's StereoSGBM, 3-way
  };
  Matcher matcher = Matcher::kSgm;
  /// Zhao et al. 2021, section 4.3: OpenCV's matchers (kSgm counts as kBlock), block 9, disparities
  /// by eq. 10 from 0, speckle window 100, no left-right check, no support test.
  bool paper = false;
  int block_px = 9;             ///< OpenCV's matchers only
  int speckle_window_px = 100;  ///< OpenCV's matchers only
  int uniqueness_percent = 15;  ///< OpenCV's matchers only
  int left_right_px = 1;        ///< -1 = no check
  /// Depth range to search [m]; 0 = 0.52 and 1.15 times the camera's height above the floor.
  double nearest_m = 0, farthest_m = 0;
  int threads = 0;  ///< 0 = the machine's, at most 4; the result is the same for any number
};

/// For OpenCV's own loops in this process (rectification, its matchers, conversions).
void use_threads(int threads);

/// Number of disparities of the paper for an image width [px] (eq. 10).
constexpr int paper_disparities(int width_px) {
  return (width_px / 8 + 15) & -16;
}

/// One exposure, unrectified, as the camera gave it.
struct StereoImages {
  ImageView left, right;
  std::int64_t number = -1;  ///< of the frame; tells a frame sent again from a frozen camera
};

/// Where the organised cloud goes; each of width * height of the rectified camera.
struct CloudImages {
  std::span<float> depth_m;            ///< 0 = no match
  std::span<std::uint8_t> confidence;  ///< 0..255
  std::span<std::uint8_t> colour;      ///< BGR, 3 per pixel; may be empty
};

struct StereoReport {
  std::uint32_t matched = 0;      ///< pixels with depth
  std::uint32_t unsupported = 0;  ///< matches dropped because their neighbours disagree
  std::uint32_t near = 0;         ///< matches nearer than the search, from small images
  std::uint32_t too_near = 0;     ///< best matches at the near end of all search: dropped
  std::uint32_t unproven =
      0;  ///< matches that the images do not bear out pixel by pixel: no evidence
  std::uint32_t ambiguous = 0;         ///< matches on patterns that repeat along the rows: dropped
  std::optional<PairFlaw> flaw;        ///< the pair tells nothing: no pixel has depth
  RowError rows;                       ///< epipolar error as a function over the image
  std::optional<double> row_error_px;  ///< the largest of it, where it could be measured
  double match_ms = 0, depth_ms = 0;
};

/// Frames to disparity to organised cloud. Called by one thread; keeps its buffers between frames.
class StereoStage {
 public:
  /// Error: Configuration when the rig or the search range is impossible.
  static Result<StereoStage> create(const StereoRig& rig, const StereoSettings& settings);
  ~StereoStage();
  StereoStage(StereoStage&&) noexcept;

  [[nodiscard]] const RectifiedCamera& camera() const;
  [[nodiscard]] int first_disparity_px() const;
  [[nodiscard]] int disparities_px() const;

  /// Rectifies into memory of its own; the images are not needed after it. Returns its time [ms].
  /// Error: WrongSize if the images do not have the calibration's size, BadData for what is none.
  Result<double> rectify(const StereoImages& images);
  /// Matches the rectified pair and reprojects: Z = f b / d (eq. 4).
  Result<StereoReport> match(const CloudImages& out);

 private:
  struct Impl;
  explicit StereoStage(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace crane
