// SPDX-License-Identifier: Apache-2.0
// What a technician does to a pair of cameras, on images of the paper's rig.

#include "calibration/image_checks.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <opencv2/imgproc.hpp>

#include "imaging/convert.hpp"
#include "recording/image_file.hpp"
#include "recording/recording.hpp"
#include "temp_folder.hpp"

namespace crane {
namespace {

using ::testing::HasSubstr;

struct Pair {
  Image left, right;
};

class ImageChecks : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    const auto recording = Recording::open(test::rig_recording());
    ASSERT_TRUE(recording.ok());
    for (const std::size_t n : {0U, 3U}) {
      const auto& frame = recording.value().frames()[n];
      pairs_.push_back({grey(frame.left_file), grey(frame.right_file)});
    }
  }
  static Image grey(const std::string& file) {
    const Image image = read_image(file, 64'000'000).value();
    Image out{image.width, image.height, 1, {}};
    EXPECT_TRUE(to_grey(image.view(), out.bytes).ok());
    return out;
  }
  static std::vector<ImageFinding> examine(const std::vector<Pair>& pairs) {
    std::vector<ImagePairView> views;
    for (const Pair& p : pairs) views.push_back({&p.left, &p.right});
    return examine_images(views);
  }
  /// All that is bad, "what: text -> advice" a line.
  static std::string bad(const std::vector<Pair>& pairs) {
    std::string out;
    for (const ImageFinding& f : examine(pairs)) {
      EXPECT_EQ(f.bad, !f.advice.empty()) << f.text;
      if (f.bad) out += f.what + ": " + f.text + " -> " + f.advice + "\n";
    }
    return out;
  }
  using Change = std::function<void(cv::Mat&)>;
  static std::vector<Pair> changed(const Change& left, const Change& right) {
    std::vector<Pair> out = pairs_;
    for (Pair& p : out) {
      for (const auto& [image, change] : {std::pair{&p.left, left}, std::pair{&p.right, right}}) {
        cv::Mat pixels(int(image->height), int(image->width), CV_8UC1, image->bytes.data());
        if (change) change(pixels);
      }
    }
    return out;
  }
  inline static std::vector<Pair> pairs_;
};

void black(cv::Mat& m) {
  cv::randn(m, 4, 2);
}

TEST_F(ImageChecks, AGoodPairPassesAll) {
  EXPECT_EQ(bad(pairs_), "");
  EXPECT_EQ(examine(pairs_).size(), 5U);
}

TEST_F(ImageChecks, ALensCapIsToldFromTheLightBeingOff) {
  EXPECT_THAT(bad(changed(black, nullptr)), HasSubstr("take the cap off the left lens"));
  EXPECT_THAT(bad(changed(nullptr, black)), HasSubstr("take the cap off the right lens"));
  EXPECT_THAT(bad(changed(black, black)), HasSubstr("switch the light on; if it is"));
  const auto dim = [](cv::Mat& m) { m *= 0.12; };
  EXPECT_THAT(bad(changed(dim, dim)), HasSubstr("it is dark"));
}

TEST_F(ImageChecks, SwappedCamerasAreToldByTheirImages) {
  std::vector<Pair> swapped = pairs_;
  for (Pair& p : swapped) std::swap(p.left, p.right);
  EXPECT_THAT(bad(swapped), HasSubstr("swapped"));
  std::vector<Pair> same = pairs_;
  for (Pair& p : same) p.right = p.left;
  EXPECT_THAT(bad(same), HasSubstr("both images are the same"));
  const auto grain = [](cv::Mat& m) { cv::randn(m, 120, 30); };
  EXPECT_THAT(bad(changed(grain, grain)), HasSubstr("too little is the same"));
}

TEST_F(ImageChecks, ALensOutOfFocusAndAnExposureTooLongAreNamed) {
  const auto blur = [](cv::Mat& m) { cv::GaussianBlur(m, m, {0, 0}, 3); };
  EXPECT_THAT(bad(changed(nullptr, blur)), HasSubstr("the right image is out of focus"));
  EXPECT_THAT(bad(changed(blur, blur)), HasSubstr("left and the right image is out of focus"));
  const auto bright = [](cv::Mat& m) { m *= 3; };
  EXPECT_THAT(bad(changed(bright, nullptr)), HasSubstr("shorter exposure"));
}

TEST_F(ImageChecks, DirtOnTheGlassIsFoundWhereItIs) {
  const auto smear = [](cv::Mat& m) {
    cv::Mat part = m(cv::Rect(m.cols / 8, m.rows / 6, m.cols / 4, m.rows / 3));
    cv::GaussianBlur(part, part, {0, 0}, 25);
  };
  EXPECT_THAT(bad(changed(nullptr, smear)), HasSubstr("clean the glass before the right lens"));
  EXPECT_THAT(bad(changed(smear, nullptr)), HasSubstr("left of the left image"));
}

}  // namespace
}  // namespace crane
