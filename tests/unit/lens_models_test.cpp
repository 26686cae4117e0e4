// SPDX-License-Identifier: Apache-2.0
// Each lens model against a camera written down anew: points are projected through rig and lens,
// and must be where the rectification looks for them, in the same row of both images.

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <random>

#include "recording/calibration.hpp"
#include "stereo/rectification.hpp"
#include "temp_folder.hpp"

namespace crane {
namespace {

/// OpenCV's documents: calib3d, and its section fisheye.
Eigen::Vector2d project(const CameraModel& c, const Eigen::Vector3d& p) {
  const double a = p.x() / p.z(), b = p.y() / p.z();
  double x = 0, y = 0;
  if (c.lens == LensModel::kEquidistant) {
    const double r = std::hypot(a, b), t = std::atan(r);
    const double bent = t + c.k1 * std::pow(t, 3) + c.k2 * std::pow(t, 5) + c.k3 * std::pow(t, 7) +
                        c.k4 * std::pow(t, 9);
    x = r > 0 ? bent / r * a : a;
    y = r > 0 ? bent / r * b : b;
  } else {
    const double r2 = a * a + b * b;
    const double radial = (1 + c.k1 * r2 + c.k2 * std::pow(r2, 2) + c.k3 * std::pow(r2, 3)) /
                          (1 + c.k4 * r2 + c.k5 * std::pow(r2, 2) + c.k6 * std::pow(r2, 3));
    x = a * radial + 2 * c.p1 * a * b + c.p2 * (r2 + 2 * a * a);
    y = b * radial + c.p1 * (r2 + 2 * b * b) + 2 * c.p2 * a * b;
  }
  return {c.fx_px * x + c.cx_px, c.fy_px * y + c.cy_px};
}

/// Where the rectification looks for a rectified pixel.
Eigen::Vector2d looked_for(const cv::Mat (&maps)[2], int u, int v) {
  const auto& whole = maps[0].at<cv::Vec2s>(v, u);
  const int part = maps[1].at<std::uint16_t>(v, u);  // 5 bits each
  return {whole[0] + (part & 31) / 32.0, whole[1] + (part >> 5 & 31) / 32.0};
}

StereoRig rig_of(const std::function<void(CameraModel&)>& lens) {
  StereoRig rig;
  rig.left = {1280, 720, 700, 702, 640.3, 358.1};
  rig.right = {1280, 720, 705, 704, 636.9, 362.4};
  lens(rig.left);
  lens(rig.right);
  rig.right.k1 *= 1.1;  // no two lenses are alike
  rig.T_left_right.translation() = Eigen::Vector3d(0.12, 0.002, -0.001);
  rig.T_left_right.linear() = (Eigen::AngleAxisd(0.01, Eigen::Vector3d::UnitY()) *
                               Eigen::AngleAxisd(-0.006, Eigen::Vector3d::UnitX()) *
                               Eigen::AngleAxisd(0.008, Eigen::Vector3d::UnitZ()))
                                  .toRotationMatrix();
  rig.T_map_camera_at_zero.linear() =
      Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()).toRotationMatrix();
  rig.T_map_camera_at_zero.translation().z() = 3;
  return rig;
}

struct Lens {
  const char* name;
  std::function<void(CameraModel&)> set;
};
const Lens kLenses[] = {
    {"none", [](CameraModel&) {}},
    {"radial-tangential",
     [](CameraModel& c) { c.k1 = -0.28, c.k2 = 0.07, c.p1 = 1e-3, c.p2 = -8e-4; }},
    {"with k3",
     [](CameraModel& c) { c.k1 = -0.25, c.k2 = 0.1, c.p1 = -1e-3, c.p2 = 5e-4, c.k3 = -0.015; }},
    {"rational",
     [](CameraModel& c) {
       c.lens = LensModel::kRational;
       c.k1 = 0.5, c.k2 = -0.02, c.p1 = 4e-4, c.p2 = -6e-4, c.k3 = 0.004;
       c.k4 = 0.7, c.k5 = 0.01, c.k6 = 0.003;
     }},
    {"equidistant",
     [](CameraModel& c) {
       c.lens = LensModel::kEquidistant;
       c.k1 = -0.03, c.k2 = 0.008, c.k3 = -0.006, c.k4 = 0.001;
     }},
};

TEST(LensModels, PointsAreInTheSameRowOfBothRectifiedImages) {
  std::mt19937 random(11);
  for (const Lens& lens : kLenses) {
    SCOPED_TRACE(lens.name);
    const StereoRig rig = rig_of(lens.set);
    ASSERT_TRUE(check_rig(rig, "x")) << check_rig(rig, "x").error().text();
    const auto made = rectification_of(rig);
    ASSERT_TRUE(made) << made.error().text();
    const RectifiedCamera& camera = made->camera;
    EXPECT_NEAR(camera.baseline_m, rig.baseline_m(), 1e-9);
    const Eigen::Isometry3d T_right_left = rig.T_right_left();
    int seen = 0;
    double worst = 0, bent = 0;
    for (int i = 0; i < 4000; ++i) {
      // A rectified left pixel, and a depth for which the right one is a whole pixel as well.
      const int u = static_cast<int>(random() % camera.width);
      const int v = static_cast<int>(random() % camera.height);
      const int disparity = 10 + static_cast<int>(random() % 60);
      if (u < disparity) continue;
      const double z = camera.f_px * camera.baseline_m / disparity;
      const Eigen::Vector3d p_left =
          camera.R_camera_rectified * Eigen::Vector3d((u - camera.cx_px) / camera.f_px * z,
                                                      (v - camera.cy_px) / camera.f_px * z, z);
      const Eigen::Vector2d left = project(rig.left, p_left);
      const Eigen::Vector2d right = project(rig.right, T_right_left * p_left);
      worst = std::max({worst, (looked_for(made->left, u, v) - left).norm(),
                        (looked_for(made->right, u - disparity, v) - right).norm()});
      CameraModel straight = rig.left;
      straight.lens = LensModel::kRadialTangential;
      straight.k1 = straight.k2 = straight.k3 = straight.p1 = straight.p2 = 0;
      straight.k4 = straight.k5 = straight.k6 = 0;
      bent = std::max(bent, (project(straight, p_left) - left).norm());
      ++seen;
    }
    EXPECT_GT(seen, 3000);
    EXPECT_LT(worst, 0.05);
    // The lens is one, or nothing was tried.
    EXPECT_TRUE(bent > 10 || std::string(lens.name) == "none") << bent;
  }
}

TEST(LensModels, AreReadByTheNamesOfOthersAndWrittenAsRead) {
  for (const Lens& lens : kLenses) {
    SCOPED_TRACE(lens.name);
    const test::TempFolder folder;
    const StereoRig rig = rig_of(lens.set);
    ASSERT_TRUE(write_rig(rig, folder / "r", 10));
    const auto read = read_rig(folder / "r");
    ASSERT_TRUE(read) << read.error().text();
    for (const auto& [is, should] : {std::pair{read->left, rig.left}, {read->right, rig.right}}) {
      EXPECT_EQ(is.lens, should.lens);
      for (const auto member :
           {&CameraModel::k1, &CameraModel::k2, &CameraModel::k3, &CameraModel::k4,
            &CameraModel::k5, &CameraModel::k6, &CameraModel::p1, &CameraModel::p2})
        EXPECT_EQ(is.*member, should.*member);
    }
  }
}

/// read_rig() with cam0's model and coefficients replaced.
Result<StereoRig> read_with(const std::string& model, const std::string& coefficients) {
  const test::TempFolder folder;
  EXPECT_TRUE(write_rig(rig_of([](CameraModel&) {}), folder / "r", 10));
  for (const char* cam : {"cam0", "cam1"}) {
    const std::string path = folder / "r" + std::string("/") + cam + "/sensor.yaml";
    std::ifstream in(path);
    std::string text((std::istreambuf_iterator<char>(in)), {});
    in.close();
    text.erase(text.find("distortion_model:"));
    std::ofstream(path) << text << "distortion_model: " << model << "\ndistortion_coefficients: ["
                        << coefficients << "]\n";
  }
  return read_rig(folder / "r");
}

TEST(LensModels, NamesOfRosKalibrAndOpenCv) {
  const auto lens = [](const std::string& model, const std::string& coefficients) {
    const auto read = read_with(model, coefficients);
    EXPECT_TRUE(read) << model << ": " << read.error().text();
    return read ? read->left : CameraModel{};
  };
  EXPECT_EQ(lens("plumb_bob", "-0.1, 0.02, 0.001, 0.002, 0.003").k3, 0.003);
  EXPECT_EQ(lens("radtan", "-0.1, 0.02, 0.001, 0.002").p2, 0.002);
  EXPECT_EQ(lens("rational_polynomial", "0.1, 0.02, 0.001, 0.002, 0.003, 0.2, 0.05, 0.006").k6,
            0.006);
  EXPECT_EQ(lens("rational_polynomial",
                 "0.1, 0.02, 0.001, 0.002, 0.003, 0.2, 0.05, 0.006, 0, 0, 0, 0, 0, 0")
                .lens,
            LensModel::kRational);
  const CameraModel fisheye = lens("equidistant", "-0.01, 0.02, -0.003, 0.004");
  EXPECT_EQ(fisheye.lens, LensModel::kEquidistant);
  EXPECT_EQ(fisheye.k3, -0.003);
  EXPECT_EQ(fisheye.p1, 0);
}

TEST(LensModels, WhatCannotBeIsRefusedAndSaid) {
  const auto refusal = [](const std::string& model, const std::string& coefficients) {
    const auto read = read_with(model, coefficients);
    EXPECT_FALSE(read) << model << " [" << coefficients << "]";
    return read ? std::string() : read.error().text();
  };
  EXPECT_NE(refusal("omni", "0, 0, 0, 0").find("'omni' is not"), std::string::npos);
  EXPECT_NE(refusal("plumb_bob", "0.1, 0, 0, 0, 0, 0.2, 0, 0").find("number 6 is not 0"),
            std::string::npos);
  EXPECT_NE(refusal("rational", "0.1, 0, 0, 0, 0").find("fewer than the 8"), std::string::npos);
  EXPECT_NE(refusal("rational", "0.1, 0, 0, 0, 0, 0, 0, 0, 0.01").find("number 9"),
            std::string::npos);
  EXPECT_NE(refusal("equidistant", "0.1, 0, 0, 0, 0.1").find("number 5"), std::string::npos);
  // Folds within the borders.
  EXPECT_NE(refusal("radtan", "-0.9, 0, 0, 0").find("folds the image"), std::string::npos);
  EXPECT_NE(refusal("plumb_bob", "0, 0, 0, 0, -10").find("folds the image"), std::string::npos);
  EXPECT_NE(refusal("rational", "0, 0, 0, 0, 0, 3, 0, 0").find("folds the image"),
            std::string::npos);
  EXPECT_NE(refusal("equidistant", "-2, 0, 0, 0").find("folds the image"), std::string::npos);
  EXPECT_NE(refusal("equidistant", ".nan, 0, 0, 0"), "");

  StereoRig mixed = rig_of(kLenses[1].set);
  mixed.right.lens = LensModel::kEquidistant;
  mixed.right.k1 = mixed.right.k2 = mixed.right.p1 = mixed.right.p2 = 0;
  EXPECT_FALSE(check_rig(mixed, "x"));
}

}  // namespace
}  // namespace crane
