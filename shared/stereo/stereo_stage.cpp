// SPDX-License-Identifier: Apache-2.0
#include "stereo/stereo_stage.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <opencv2/calib3d.hpp>  // StereoBM, StereoSGBM
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "base/clock.hpp"
#include "base/threads.hpp"
#include "stereo/disparity_support.hpp"
#include "stereo/evidence.hpp"
#include "stereo/near_field.hpp"
#include "stereo/pair_contrast.hpp"
#include "stereo/rectification.hpp"
#include "stereo/repetition.hpp"
#include "stereo/semi_global.hpp"

namespace crane {
namespace {

/// Search range as a share of the camera's height above the floor, unless told otherwise: things up
/// to nearly half of it, and holes in the floor. Each 16 px of disparity cost a sixth of the time.
constexpr double kNearest = 0.52, kFarthest = 1.15;
/// What is nearer than that, up to this share, is searched for in small images.
constexpr double kNearField = 0.2;
constexpr int kOpenCvScale = 16;
constexpr int kOpenCvFactor = kDisparityScale / kOpenCvScale;
constexpr std::uint8_t kMinSupport = 80;  ///< a third of the neighbours
/// Disparities are kept in 16 bits.
constexpr int kMostDisparity_px = 32'767 / kDisparityScale - 1;
constexpr double kMinMatched = 0.03;  ///< share of the pixels; fewer: the pair does not overlap

cv::Ptr<cv::StereoMatcher> make_matcher(const StereoSettings& s, int first, int count) {
  const bool strict = !s.paper && s.left_right_px >= 0;
  cv::Ptr<cv::StereoMatcher> matcher;
  if (s.matcher == StereoSettings::Matcher::kBlock) {
    auto bm = cv::StereoBM::create(count, s.block_px);
    bm->setUniquenessRatio(s.uniqueness_percent);
    bm->setTextureThreshold(10);
    bm->setPreFilterCap(31);
    matcher = bm;
  } else {
    const int area = s.block_px * s.block_px;
    matcher = cv::StereoSGBM::create(first, count, s.block_px, 8 * area, 32 * area, 1, 63,
                                     std::min(s.uniqueness_percent, 10), 0, 0,
                                     cv::StereoSGBM::MODE_SGBM_3WAY);
  }
  matcher->setMinDisparity(first);
  matcher->setSpeckleWindowSize(s.speckle_window_px);
  matcher->setSpeckleRange(s.matcher == StereoSettings::Matcher::kBlock && s.paper ? 32 : 2);
  matcher->setDisp12MaxDiff(strict ? s.left_right_px : -1);
  return matcher;
}

}  // namespace

struct StereoStage::Impl {
  StereoSettings settings;
  cv::Size size;
  Rectification rectification;
  const RectifiedCamera& camera = rectification.camera;
  int first = 0, count = 0;
  cv::Ptr<cv::StereoMatcher> opencv;  ///< one of these two
  std::unique_ptr<SemiGlobalMatcher> sgm;
  std::optional<NearField> near_field;   ///< beside sgm
  std::optional<Repetition> repetition;  ///< likewise
  Evidence evidence;                     ///< of what sgm found
  PairCheck check;
  bool coloured = false;
  std::int64_t number = -1;
  cv::Mat left_colour, left, right, disparity;
  Image left_decoded, right_decoded;
  std::vector<std::uint8_t> converted;

  /// What is grey or BGR already is not copied.
  Result<cv::Mat> grey_of(const ImageView& image) { return as(image, PixelFormat::kMono8); }
  Result<cv::Mat> bgr_of(const ImageView& image) { return as(image, PixelFormat::kBgr8); }

 private:
  Result<cv::Mat> as(const ImageView& image, PixelFormat wanted) {
    const bool grey = wanted == PixelFormat::kMono8;
    const int type = grey ? CV_8UC1 : CV_8UC3;
    if (image.format == wanted &&
        image_flaw(image.format, image.width, image.height, image.bytes.size()) == nullptr)
      return cv::Mat(size, type, const_cast<std::uint8_t*>(image.bytes.data()));
    const auto done = grey ? to_grey(image, converted) : to_bgr(image, converted);
    if (!done) return done.error();
    return cv::Mat(size, type, converted.data());
  }
};

void use_threads(int threads) {
  cv::setNumThreads(threads_or_default(threads));
}

StereoStage::StereoStage(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
StereoStage::~StereoStage() = default;
StereoStage::StereoStage(StereoStage&&) noexcept = default;

const RectifiedCamera& StereoStage::camera() const {
  return impl_->camera;
}
int StereoStage::first_disparity_px() const {
  return impl_->first;
}
int StereoStage::disparities_px() const {
  return impl_->count;
}

Result<StereoStage> StereoStage::create(const StereoRig& rig, const StereoSettings& settings) {
  if (auto usable = check_rig(rig, "calibration"); !usable) return usable.error();
  auto impl = std::make_unique<Impl>();
  impl->settings = settings;
  if (settings.paper && settings.matcher == StereoSettings::Matcher::kSgm)
    impl->settings.matcher = StereoSettings::Matcher::kBlock;
  impl->size = {static_cast<int>(rig.left.width), static_cast<int>(rig.left.height)};
  auto rectification = rectification_of(rig);
  if (!rectification) return rectification.error();
  impl->rectification = std::move(*rectification);
  const RectifiedCamera& camera = impl->rectification.camera;
  const double fb = camera.f_px * camera.baseline_m;
  if (settings.paper) {
    impl->first = 0;
    impl->count = paper_disparities(impl->size.width);
  } else {
    const double height = rig.camera_height_m();
    const double nearest = settings.nearest_m > 0 ? settings.nearest_m : kNearest * height;
    const double farthest = settings.farthest_m > 0 ? settings.farthest_m : kFarthest * height;
    if (!(nearest < farthest))
      return Error{ErrorCode::kConfiguration, "stereo.nearest_m",
                   std::to_string(nearest) + " m is not nearer than farthest_m " +
                       std::to_string(farthest) + " m",
                   "correct one of them"};
    impl->first = static_cast<int>(std::floor(fb / farthest));
    const int last = static_cast<int>(std::ceil(fb / nearest));
    impl->count = std::max(16, (last - impl->first + 1 + 15) & -16);
  }
  if (impl->first + impl->count > impl->size.width - settings.block_px ||
      impl->first + impl->count > kMostDisparity_px ||
      (impl->settings.matcher == StereoSettings::Matcher::kSgm && impl->count > 256))
    return Error{ErrorCode::kConfiguration, "stereo",
                 "a search up to " + std::to_string(impl->first + impl->count) + " px, over " +
                     std::to_string(impl->count) + " px, is impossible in an image " +
                     std::to_string(impl->size.width) + " px wide (matcher sgm: at most 256 px)",
                 "raise stereo.nearest_m"};
  if (impl->settings.matcher == StereoSettings::Matcher::kSgm &&
      (impl->size.width < SemiGlobalMatcher::kMinWidth ||
       impl->size.height < SemiGlobalMatcher::kMinHeight))
    return Error{ErrorCode::kConfiguration, "stereo.matcher",
                 "images of " + std::to_string(impl->size.width) + " x " +
                     std::to_string(impl->size.height) + " px are too small for sgm",
                 "set it to bm"};
  if (impl->settings.matcher == StereoSettings::Matcher::kSgm) {
    SemiGlobalSettings sgm;
    sgm.first_px = impl->first;
    sgm.count_px = impl->count;
    sgm.threads = settings.threads;
    sgm.left_right_px = settings.left_right_px < 0 ? impl->count : settings.left_right_px;
    impl->sgm = std::make_unique<SemiGlobalMatcher>(impl->size.width, impl->size.height, sgm);
    impl->count = SemiGlobalMatcher::disparities(impl->count);
    const double nearest = kNearField * rig.camera_height_m();
    impl->repetition.emplace(impl->size.width, impl->size.height, impl->count,
                             impl->first + impl->count - 1, settings.threads);
    impl->evidence = Evidence(settings.threads);
    impl->near_field =
        NearField::create(impl->size.width, impl->size.height,
                          {impl->first, impl->first + impl->count - 1,
                           std::min(static_cast<int>(fb / nearest), kMostDisparity_px)},
                          settings.threads);
  } else {
    impl->opencv = make_matcher(impl->settings, impl->first, impl->count);
  }
  impl->disparity.create(impl->size, CV_16S);
  return StereoStage(std::move(impl));
}

Result<double> StereoStage::rectify(const StereoImages& images) {
  Impl& m = *impl_;
  for (const ImageView* image : {&images.left, &images.right})
    if (image->width != m.camera.width || image->height != m.camera.height)
      return Error{ErrorCode::kWrongSize, "stereo frame",
                   std::to_string(image->width) + " x " + std::to_string(image->height) +
                       " pixels, calibrated for " + std::to_string(m.size.width) + " x " +
                       std::to_string(m.size.height),
                   "use the calibration of this camera at this resolution"};
  const Stopwatch watch;
  try {
    m.number = images.number;
    const auto raw_left = decoded(images.left, m.left_decoded);
    if (!raw_left) return raw_left.error();
    const auto raw_right = decoded(images.right, m.right_decoded);
    if (!raw_right) return raw_right.error();
    m.coloured = may_have_colour(raw_left->format);
    const auto rectify = [&m](const cv::Mat& raw, bool left, cv::Mat& out) {
      const cv::Mat* map = left ? m.rectification.left : m.rectification.right;
      cv::remap(raw, out, map[0], map[1], cv::INTER_LINEAR);
    };
    for (const bool left : {true, false}) {
      const auto grey = m.grey_of(left ? *raw_left : *raw_right);
      if (!grey) return grey.error();
      rectify(*grey, left, left ? m.left : m.right);
    }
    if (m.coloured) {
      const auto colour = m.bgr_of(*raw_left);
      if (!colour) return colour.error();
      rectify(*colour, true, m.left_colour);
    }
  } catch (const cv::Exception& e) {
    return Error{ErrorCode::kBadData, "stereo frame", "OpenCV: " + e.err, ""};
  }
  return watch.ms();
}

Result<StereoReport> StereoStage::match(const CloudImages& out) {
  Impl& m = *impl_;
  const std::size_t pixels = std::size_t(m.size.area());
  expects(!m.left.empty(), "rectify() came first");
  expects(out.depth_m.size() == pixels && out.confidence.size() == pixels,
          "outputs fit the rectified camera");
  expects(out.colour.empty() || out.colour.size() == 3 * pixels, "colour fits or is empty");
  StereoReport report;
  try {
    const Stopwatch matching;
    const auto view = [](const cv::Mat& image) {
      return GreyView{image.data, image.cols, image.rows, static_cast<std::ptrdiff_t>(image.step)};
    };
    std::uint32_t overlap = 0;  // pixels that the matcher found a match for
    const auto first_valid = static_cast<std::int16_t>(
        std::max(m.first * kDisparityScale, m.settings.paper ? kDisparityScale / 2 + 1 : 1));
    const auto look_at_pair = [&](std::span<const std::int16_t> found) {
      report.rows = row_error(view(m.left), view(m.right), found);
      report.row_error_px = largest_px(report.rows, m.left.cols, m.left.rows);
      const bool rows_fit = std::abs(report.row_error_px.value_or(0)) < kRowErrorLimit_px;
      if (rows_fit)  // else that is the reason, and is said
        report.flaw = flaw_of(look_at_contrast(view(m.left), view(m.right), found, first_valid));
    };
    if (!m.settings.paper) report.flaw = m.check.look(view(m.left), view(m.right), m.number);
    if (report.flaw) {
      m.disparity.setTo(0);
    } else if (m.sgm) {
      const std::span<std::int16_t> found(m.disparity.ptr<std::int16_t>(), pixels);
      const SemiGlobalReport said =
          m.sgm->match(view(m.left), view(m.right), found, out.confidence);
      report.too_near = said.at_near_end;
      overlap = said.matched;
      look_at_pair(found);  // of what was matched, not of what is left of it
      if (!report.flaw) {
        const EvidenceReport proven =
            m.evidence.keep_proven(view(m.left), view(m.right), found, out.confidence);
        report.unproven = proven.unexplained + proven.borrowed;
        if (m.near_field) {
          const NearFieldReport near =
              m.near_field->apply(view(m.left), view(m.right), found, out.confidence);
          report.near = near.matched;
          report.too_near = near.too_near;
        }
        report.ambiguous = m.repetition->drop_ambiguous(view(m.left), found, out.confidence);
      }
    } else {
      m.opencv->compute(m.left, m.right, m.disparity);
      m.disparity *= kOpenCvFactor;
    }
    report.match_ms = matching.ms();

    const Stopwatch depth;
    const std::span<const std::int16_t> disparity(m.disparity.ptr<std::int16_t>(), pixels);
    if (report.flaw)
      std::fill(out.confidence.begin(), out.confidence.end(), std::uint8_t{0});
    else if (!m.sgm)
      disparity_support(disparity, m.camera.width, m.camera.height, first_valid, out.confidence);
    // eq. 4: z = f b / d; below 0 where it proves nothing free
    const float fb = static_cast<float>(m.camera.f_px * m.camera.baseline_m * kDisparityScale);
    if (m.sgm) {
      const int threads = threads_or_default(m.settings.threads);
      std::atomic<std::uint32_t> matched{0};
      on_threads(threads, [&](int thread, Meeting&) {
        const auto [begin, end] = share_of(static_cast<int>(pixels), thread, threads);
        std::uint32_t own = 0;
        for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
          const int d = disparity[i];
          out.depth_m[i] = d != 0 ? fb / static_cast<float>(d) : 0.0F;
          own += d > 0 && out.confidence[i] > 0 ? 1 : 0;
        }
        matched += own;
      });
      report.matched = matched;
    }
    for (std::size_t i = 0; i < pixels && !m.sgm; ++i) {
      const bool matched = disparity[i] >= first_valid;
      const bool supported = m.settings.paper || out.confidence[i] >= kMinSupport;
      report.unsupported += matched && !supported ? 1 : 0;
      report.matched += matched && supported ? 1 : 0;
      out.depth_m[i] = matched && supported ? fb / static_cast<float>(disparity[i]) : 0.0F;
      if (matched && m.settings.paper && out.confidence[i] == 0) out.confidence[i] = 1;
    }
    if (!m.settings.paper) {
      if (!m.sgm && !report.flaw) look_at_pair(disparity);
      if (!report.flaw && std::max(overlap, report.matched) < kMinMatched * double(pixels))
        report.flaw = PairFlaw::kNoOverlap;
      if (report.flaw) {
        report.matched = 0;
        std::fill(out.depth_m.begin(), out.depth_m.end(), 0.0F);
        std::fill(out.confidence.begin(), out.confidence.end(), std::uint8_t{0});
      }
    }
    if (!out.colour.empty()) {
      const cv::Mat target(m.size, CV_8UC3, out.colour.data());
      if (m.coloured)
        m.left_colour.copyTo(target);
      else
        cv::cvtColor(m.left, target, cv::COLOR_GRAY2BGR);
    }
    report.depth_ms = depth.ms();
  } catch (const cv::Exception& e) {
    return Error{ErrorCode::kBadData, "stereo frame", "OpenCV: " + e.err, ""};
  } catch (const std::exception& e) {
    return Error{ErrorCode::kResource, "stereo frame",
                 std::string("cannot be matched: ") + e.what(), "give the service more memory"};
  }
  return report;
}

}  // namespace crane
