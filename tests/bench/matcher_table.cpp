// SPDX-License-Identifier: Apache-2.0
// Matchers side by side on frames with true depth, and on real pairs with true disparity.
// usage: cranemap-matcher-table RECORDING [FRAMES]   or   cranemap-matcher-table --pair LEFT RIGHT
// TRUTH SCALE MAX

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/utility.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "base/clock.hpp"
#include "recording/recording.hpp"
#include "stereo/semi_global.hpp"

namespace crane {
namespace {

struct Pair {
  std::string name;
  cv::Mat left, right;  // rectified, grey
  cv::Mat truth;        // float32 disparity; 0 = not known
  int first = 0, count = 64;
};

/// Pixels of the left image whose point the right one sees too.
cv::Mat seen_by_both(const cv::Mat& truth) {
  cv::Mat seen(truth.size(), CV_8U, cv::Scalar(0));
  std::vector<float> nearest(std::size_t(truth.cols));
  for (int y = 0; y < truth.rows; ++y) {
    std::fill(nearest.begin(), nearest.end(), 0.0F);
    const float* d = truth.ptr<float>(y);
    for (int x = 0; x < truth.cols; ++x) {
      const int r = x - int(std::lround(d[x]));
      if (d[x] > 0 && r >= 0) nearest[std::size_t(r)] = std::max(nearest[std::size_t(r)], d[x]);
    }
    for (int x = 0; x < truth.cols; ++x) {
      const int r = x - int(std::lround(d[x]));
      if (!(d[x] > 0) || r < 0) continue;
      float cover = nearest[std::size_t(r)];
      if (r > 0) cover = std::max(cover, nearest[std::size_t(r) - 1]);
      if (r + 1 < truth.cols) cover = std::max(cover, nearest[std::size_t(r) + 1]);
      if (d[x] >= cover - 1.5F) seen.at<std::uint8_t>(y, x) = 1;
    }
  }
  return seen;
}

struct Score {
  std::vector<double> ratios;  ///< of the time to the first row's in the same round
  double ms = 0, density = 0, bad1 = 0, bad2 = 0, median = 0, bias = 0, spread = 0;
  std::size_t frames = 0;
};

using Matcher = std::function<void(const Pair&, cv::Mat&)>;  // float32 disparity, <= 0 none

/// Judges what one matcher made of a pair in `best_ms`.
void judge(Score& s, const Pair& pair, const cv::Mat& disparity, double best_ms) {
  const cv::Mat seen = seen_by_both(pair.truth);
  std::size_t seen_n = 0, matched = 0, known = 0, bad1 = 0, bad2 = 0;
  std::vector<float> errors;
  double sum = 0, squares = 0;
  for (int y = 0; y < seen.rows; ++y)
    for (int x = 0; x < seen.cols; ++x) {
      const float d = disparity.at<float>(y, x);
      const float t = pair.truth.at<float>(y, x);
      const bool s_ = seen.at<std::uint8_t>(y, x) != 0;
      seen_n += s_;
      matched += s_ && d > 0;
      if (!(d > 0) || !(t > 0) || !s_) continue;
      ++known;
      const float e = std::abs(d - t);
      if (e < 1) sum += d - t, squares += double(d - t) * double(d - t);
      bad1 += e > 1;
      bad2 += e > 2;
      errors.push_back(e);
    }
  s.ms += best_ms;
  s.density += double(matched) / double(seen_n);
  s.bad1 += double(bad1) / double(known);
  s.bad2 += double(bad2) / double(known);
  std::nth_element(errors.begin(), errors.begin() + std::ptrdiff_t(errors.size() / 2),
                   errors.end());
  s.median += errors[errors.size() / 2];
  const double mean = sum / double(known - bad1);
  s.bias += mean;
  s.spread += std::sqrt(squares / double(known - bad1) - mean * mean);
  ++s.frames;
}

Matcher opencv(const cv::Ptr<cv::StereoMatcher>& matcher) {
  return [matcher](const Pair& p, cv::Mat& out) {
    cv::Mat d;
    matcher->compute(p.left, p.right, d);
    d.convertTo(out, CV_32F, 1.0 / 16);
    out.setTo(0, out < p.first);
  };
}

struct Row {
  std::string name;
  std::function<Matcher(const Pair&)> make;
};

std::vector<Row> rows() {
  const auto block = [](int first, int count) {
    auto bm = cv::StereoBM::create(count, 9);
    bm->setMinDisparity(first);
    bm->setUniquenessRatio(15);
    bm->setTextureThreshold(10);
    bm->setSpeckleWindowSize(100);
    bm->setSpeckleRange(32);
    return opencv(bm);
  };
  const auto semi = [](const Pair& p, int block_px, int mode) {
    return opencv(cv::StereoSGBM::create(p.first, p.count, block_px, 8 * block_px * block_px,
                                         32 * block_px * block_px, 1, 63, 10, 100, 2, mode));
  };
  return {
      {"StereoBM 160", [=](const Pair&) { return block(0, 160); }},
      {"StereoBM bounded", [=](const Pair& p) { return block(p.first, p.count); }},
      {"SGBM 3-way", [=](const Pair& p) { return semi(p, 5, cv::StereoSGBM::MODE_SGBM_3WAY); }},
      {"SGBM", [=](const Pair& p) { return semi(p, 5, cv::StereoSGBM::MODE_SGBM); }},
      {"SGBM HH", [=](const Pair& p) { return semi(p, 3, cv::StereoSGBM::MODE_HH); }},
      {"cranemap SGM",
       [](const Pair& p) {
         SemiGlobalSettings s;
         s.first_px = p.first;
         s.count_px = p.count;
         auto matcher = std::make_shared<SemiGlobalMatcher>(p.left.cols, p.left.rows, s);
         return [matcher](const Pair& q, cv::Mat& out) {
           cv::Mat d(q.left.size(), CV_16S);
           cv::Mat c(q.left.size(), CV_8U);
           const std::size_t n = std::size_t(q.left.rows) * q.left.cols;
           matcher->match({q.left.data, q.left.cols, q.left.rows, std::ptrdiff_t(q.left.step)},
                          {q.right.data, q.left.cols, q.left.rows, std::ptrdiff_t(q.right.step)},
                          {d.ptr<std::int16_t>(), n}, {c.data, n});
           d.convertTo(out, CV_32F, 1.0 / kDisparityScale);
         };
       }},
  };
}

/// All matchers in turn, several rounds: other programs and clocks disturb all of them alike.
void table(const std::vector<Pair>& pairs) {
  constexpr int kRounds = 9;
  const std::vector<Row> matchers = rows();
  std::vector<Score> scores(matchers.size());
  for (const Pair& p : pairs) {
    std::vector<Matcher> ready;
    for (const Row& row : matchers) ready.push_back(row.make(p));
    std::vector<cv::Mat> disparity(ready.size());
    std::vector<double> best_ms(ready.size(), 1e9);
    for (int round = 0; round < kRounds; ++round) {
      double reference = 0;
      for (std::size_t i = 0; i < ready.size(); ++i) {
        const Stopwatch watch;
        ready[i](p, disparity[i]);
        const double ms = watch.ms();
        best_ms[i] = std::min(best_ms[i], ms);
        if (i == 0) reference = ms;
        scores[i].ratios.push_back(ms / reference);
      }
    }
    for (std::size_t i = 0; i < ready.size(); ++i) judge(scores[i], p, disparity[i], best_ms[i]);
  }
  std::printf("%-18s %8s %9s %8s %8s %10s %8s %8s\n", "matcher", "ms", "density", "bad>1 %",
              "bad>2 %", "median px", "bias px", "sd px");
  for (std::size_t i = 0; i < scores.size(); ++i) {
    Score& s = scores[i];
    const double n = double(s.frames);
    std::sort(s.ratios.begin(), s.ratios.end());
    std::printf(
        "%-18s %8.1f %9.4f %8.3f %8.3f %10.4f %8.4f %8.4f   of StereoBM 160's time: least %.2f, in "
        "one round least %.2f, median %.2f\n",
        matchers[i].name.c_str(), s.ms / n, s.density / n, 100 * s.bad1 / n, 100 * s.bad2 / n,
        s.median / n, s.bias / n, s.spread / n, s.ms / scores[0].ms, s.ratios.front(),
        s.ratios[s.ratios.size() / 2]);
  }
}

std::vector<Pair> from_recording(const std::string& folder, std::size_t max_frames) {
  const auto recording = Recording::open(folder);
  if (!recording) {
    std::fprintf(stderr, "%s\n", recording.error().text().c_str());
    std::exit(2);
  }
  const StereoRig& rig = recording->rig();
  const auto K = [](const CameraModel& c) {
    return cv::Matx33d(c.fx_px, 0, c.cx_px, 0, c.fy_px, c.cy_px, 0, 0, 1);
  };
  const auto D = [](const CameraModel& c) { return cv::Vec4d(c.k1, c.k2, c.p1, c.p2); };
  const auto T = rig.T_right_left();
  cv::Matx33d R;
  cv::Vec3d t;
  for (int r = 0; r < 3; ++r) {
    t[r] = T.translation()[r];
    for (int c = 0; c < 3; ++c) R(r, c) = T.linear()(r, c);
  }
  const cv::Size size(int(rig.left.width), int(rig.left.height));
  cv::Mat R1, R2, P1, P2, Q, m1, m2, n1, n2;
  cv::stereoRectify(K(rig.left), D(rig.left), K(rig.right), D(rig.right), size, R, t, R1, R2, P1,
                    P2, Q, cv::CALIB_ZERO_DISPARITY, 0);
  cv::initUndistortRectifyMap(K(rig.left), D(rig.left), R1, P1, size, CV_32F, m1, m2);
  cv::initUndistortRectifyMap(K(rig.right), D(rig.right), R2, P2, size, CV_32F, n1, n2);
  const double fb = -P2.at<double>(0, 3);
  const double height = rig.camera_height_m();
  std::vector<Pair> out;
  for (const RecordedFrame& f : recording->frames()) {
    if (out.size() == max_frames) break;
    Pair p;
    p.name = f.left_file;
    cv::remap(cv::imread(f.left_file, cv::IMREAD_GRAYSCALE), p.left, m1, m2, cv::INTER_LINEAR);
    cv::remap(cv::imread(f.right_file, cv::IMREAD_GRAYSCALE), p.right, n1, n2, cv::INTER_LINEAR);
    std::string truth =
        folder + "/truth/depth0/" + f.left_file.substr(f.left_file.rfind('/') + 1, 19) + ".png";
    const cv::Mat mm = cv::imread(truth, cv::IMREAD_UNCHANGED);
    if (mm.empty()) continue;
    cv::Mat rectified;
    cv::remap(mm, rectified, m1, m2, cv::INTER_NEAREST);
    p.truth = cv::Mat(size, CV_32F, cv::Scalar(0));
    for (int y = 0; y < size.height; ++y)
      for (int x = 0; x < size.width; ++x)
        if (const auto z = rectified.at<std::uint16_t>(y, x); z > 0 && z < 65535)
          p.truth.at<float>(y, x) = float(fb / (z * 1e-3));
    p.first = int(fb / (1.15 * height));
    p.count = (int(fb / (0.52 * height)) - p.first + 16) & -16;
    out.push_back(p);
  }
  return out;
}

}  // namespace
}  // namespace crane

int main(int argc, char** argv) {
  using namespace crane;
  if (argc == 7 && std::strcmp(argv[1], "--pair") == 0) {
    Pair p;
    p.left = cv::imread(argv[2], cv::IMREAD_GRAYSCALE);
    p.right = cv::imread(argv[3], cv::IMREAD_GRAYSCALE);
    cv::imread(argv[4], cv::IMREAD_GRAYSCALE).convertTo(p.truth, CV_32F, 1.0 / std::atof(argv[5]));
    p.count = std::atoi(argv[6]);
    table({p});
    return 0;
  }
  if (argc < 2) return 2;
  const auto pairs = from_recording(argv[1], argc > 2 ? std::size_t(std::atoi(argv[2])) : 3);
  std::printf("%zu frames of %s, search %d..%d px\n", pairs.size(), argv[1], pairs[0].first,
              pairs[0].first + pairs[0].count - 1);
  table(pairs);
  return 0;
}
