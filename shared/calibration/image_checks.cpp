// SPDX-License-Identifier: Apache-2.0
#include "calibration/image_checks.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "base/format.hpp"
#include "imaging/convert.hpp"

namespace crane {
namespace {

constexpr double kBlack = 14;        ///< grey of a covered lens, its noise included
constexpr double kDark = 45;         ///< the brightest percent of an image that is lit is brighter
constexpr double kWhite = 250;       ///< nothing can be told apart from here
constexpr double kMostWhite = 0.05;  ///< share of the image
/// Finest against next finer detail: 0.87 of an edge blurred by 0.7 px, 0.47 by 1.5, 0.32 by 3.
constexpr double kSharp = 0.45;
constexpr double kFocusApart = 0.6;  ///< of one eye against the other
constexpr int kColumns = 8, kRows = 6;
constexpr double kSmeared = 0.3;  ///< detail in a part against that of the other eye
constexpr double kDetail = 2.5;   ///< grey; less is no texture
constexpr double kFound = 0.75;   ///< correlation of a patch with its place in the other image
constexpr int kFewPatches = 3;

constexpr const char* kEyes[] = {"left", "right"};

/// The value that this share of the pixels does not exceed.
double percentile(const cv::Mat& values, double share) {
  std::vector<float> all;
  all.reserve(values.total());
  for (int y = 0; y < values.rows; ++y)
    all.insert(all.end(), values.ptr<float>(y), values.ptr<float>(y) + values.cols);
  const auto at = all.begin() + static_cast<std::ptrdiff_t>(share * double(all.size() - 1));
  std::nth_element(all.begin(), at, all.end());
  return *at;
}

struct Bands {
  cv::Mat fine, coarse;  ///< absolute detail of one and of two pixels
};
Bands bands_of(const cv::Mat& grey) {
  cv::Mat once, twice;
  cv::GaussianBlur(grey, once, {0, 0}, 1);
  cv::GaussianBlur(grey, twice, {0, 0}, 2.2);
  return {cv::abs(grey - once), cv::abs(once - twice)};
}

/// One eye over all pairs.
struct Eye {
  std::vector<cv::Mat> grey;  ///< float
  double mean = 0, bright = 0, white = 0, sharpness = 0;
  std::vector<double> detail;  ///< of each part of the image, the most that any pair shows
};

Eye look(const std::vector<ImagePairView>& pairs, bool right) {
  Eye eye;
  eye.detail.assign(std::size_t{kColumns} * kRows, 0);
  for (const ImagePairView& pair : pairs) {
    const Image& image = right ? *pair.right : *pair.left;
    std::vector<std::uint8_t> bytes;
    if (!to_grey(image.view(), bytes)) continue;
    cv::Mat grey;
    cv::Mat(int(image.height), int(image.width), CV_8UC1, bytes.data()).convertTo(grey, CV_32F);
    const Bands bands = bands_of(grey);
    eye.mean += cv::mean(grey)[0] / double(pairs.size());
    eye.bright = std::max(eye.bright, percentile(grey, 0.99));
    eye.white = std::max(eye.white, cv::countNonZero(grey >= kWhite) / double(grey.total()));
    eye.sharpness = std::max(eye.sharpness, percentile(bands.fine, 0.995) /
                                                std::max(1.0, percentile(bands.coarse, 0.995)));
    for (int i = 0; i < kColumns * kRows; ++i) {
      const cv::Rect part(grey.cols * (i % kColumns) / kColumns, grey.rows * (i / kColumns) / kRows,
                          grey.cols / kColumns, grey.rows / kRows);
      double& most = eye.detail[static_cast<std::size_t>(i)];
      most = std::max(most, percentile(bands.coarse(part), 0.95));
    }
    eye.grey.push_back(grey);
  }
  return eye;
}

/// How far patches of the left image lie to the right of where the right image has them [px]; the
/// middle of those that are found.
struct Shift {
  double px = 0;
  int found = 0;
};
Shift shift_of(const cv::Mat& left, const cv::Mat& right) {
  std::vector<double> shifts;
  const cv::Size patch(left.cols / 10, left.rows / 10);
  const int up = std::max(4, left.rows / 30);
  for (int row = 1; row < 5; ++row)
    for (int column = 1; column < 5; ++column) {
      const cv::Rect from(left.cols * column / 5 - patch.width / 2,
                          left.rows * row / 5 - patch.height / 2, patch.width, patch.height);
      const cv::Rect band =
          cv::Rect(0, from.y - up, right.cols, patch.height + 2 * up) & cv::Rect({}, right.size());
      cv::Scalar mean, deviation;
      cv::meanStdDev(left(from), mean, deviation);
      if (deviation[0] < kDetail) continue;
      cv::Mat score;
      cv::matchTemplate(right(band), left(from), score, cv::TM_CCOEFF_NORMED);
      double best = 0;
      cv::Point at;
      cv::minMaxLoc(score, nullptr, &best, nullptr, &at);
      if (best > kFound) shifts.push_back(from.x - at.x);
    }
  if (shifts.empty()) return {};
  const auto middle = shifts.begin() + static_cast<std::ptrdiff_t>(shifts.size() / 2);
  std::nth_element(shifts.begin(), middle, shifts.end());
  return {*middle, static_cast<int>(shifts.size())};
}

std::string part_words(int i) {
  static constexpr const char* kRow[] = {"upper", "middle", "lower"};
  static constexpr const char* kColumn[] = {"left", "middle", "right"};
  return std::string(kRow[i / kColumns * 3 / kRows]) + " " + kColumn[i % kColumns * 3 / kColumns];
}

class Examination {
 public:
  explicit Examination(const std::vector<ImagePairView>& pairs)
      : eyes_{look(pairs, false), look(pairs, true)} {}

  std::vector<ImageFinding> all() {
    if (!light()) return std::move(out_);  // in the dark nothing else is to be seen
    exposure();
    focus();
    dirt();
    order();
    return std::move(out_);
  }

 private:
  void good(const char* what, std::string text) {
    out_.push_back({false, what, std::move(text), ""});
  }
  void bad(const char* what, std::string text, std::string advice) {
    out_.push_back({true, what, std::move(text), std::move(advice)});
  }

  bool light() {
    const bool black[] = {eyes_[0].bright < kBlack, eyes_[1].bright < kBlack};
    if (black[0] && black[1]) {
      bad("light", "both images are black",
          "switch the light on; if it is, take the caps off both lenses");
    } else if (black[0] || black[1]) {
      const char* eye = kEyes[black[0] ? 0 : 1];
      bad("lens cap", formatted("the %s image is black, the other one is not", eye),
          formatted("take the cap off the %s lens", eye));
    } else if (std::min(eyes_[0].bright, eyes_[1].bright) < kDark) {
      bad("light",
          formatted("it is dark: of 255 the brightest parts have %.0f (left) and %.0f (right)",
                    eyes_[0].bright, eyes_[1].bright),
          "switch the light on that the crane works by, or set a longer exposure "
          "(camera.exposure_100us)");
    } else {
      good("light", formatted("mean grey %.0f and %.0f of 255", eyes_[0].mean, eyes_[1].mean));
      return true;
    }
    return false;
  }

  void exposure() {
    for (const int i : {0, 1})
      if (eyes_[i].white > kMostWhite)
        return bad("exposure",
                   formatted("%.0f %% of the %s image is white", 100 * eyes_[i].white, kEyes[i]),
                   "set a shorter exposure, or keep lamps and their mirror images out of the view");
    good("exposure", "nothing is washed out");
  }

  void focus() {
    const double a = eyes_[0].sharpness, b = eyes_[1].sharpness;
    const bool blurred[] = {a < kSharp || a < kFocusApart * b, b < kSharp || b < kFocusApart * a};
    if (!blurred[0] && !blurred[1])
      return good("focus", formatted("sharp: %.2f and %.2f (%.2f is needed)", a, b, kSharp));
    bad("focus",
        formatted("the %s image is out of focus (%.2f left, %.2f right; %.2f is needed)",
                  blurred[0] && blurred[1] ? "left and the right" : kEyes[blurred[0] ? 0 : 1], a, b,
                  kSharp),
        "focus on the floor, then lock the lens; a lens with grease or dew on it looks the same");
  }

  void dirt() {
    for (const int i : {0, 1})
      for (int part = 0; part < kColumns * kRows; ++part) {
        const auto n = static_cast<std::size_t>(part);
        const double here = eyes_[i].detail[n], there = eyes_[1 - i].detail[n];
        if (there > 2 * kDetail && here < kSmeared * there)
          return bad("dirt",
                     formatted("the %s of the %s image shows nothing where the other camera sees "
                               "something",
                               part_words(part).c_str(), kEyes[i]),
                     formatted("clean the glass before the %s lens; nothing may hang before it",
                               kEyes[i]));
      }
    good("dirt", "both cameras see something in all parts");
  }

  void order() {
    Shift best;
    for (std::size_t n = 0; n < std::min(eyes_[0].grey.size(), eyes_[1].grey.size()); ++n)
      if (const Shift s = shift_of(eyes_[0].grey[n], eyes_[1].grey[n]); s.found > best.found)
        best = s;
    if (best.found < kFewPatches)
      return bad("left and right", "too little is the same in both images to tell them apart",
                 "let the cameras look at a floor with marks on it, and check that both belong to "
                 "this crane");
    if (best.px <= -1)
      return bad(
          "left and right",
          formatted("swapped: things lie %.0f px further right in the right image", -best.px),
          "swap the two cables, or camera.path with camera.right (camera.swap of one device)");
    if (best.px < 1)
      return bad("left and right", "both images are the same",
                 "connect the second camera: one of them is shown twice");
    good("left and right", formatted("in order: things lie %.0f px apart", best.px));
  }

  Eye eyes_[2];
  std::vector<ImageFinding> out_;
};

}  // namespace

std::vector<ImageFinding> examine_images(const std::vector<ImagePairView>& pairs) {
  return Examination(pairs).all();
}

}  // namespace crane
