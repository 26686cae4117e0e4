// SPDX-License-Identifier: Apache-2.0
#include "recording/calibration.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <sstream>

#include "temp_folder.hpp"

namespace crane {
namespace {

namespace fs = std::filesystem;
using test::TempFolder;

std::string text_of(const std::string& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

/// `cam`: 0 or 1; T_BS is replaced by this matrix.
void set_body(const std::string& folder, int cam, const Eigen::Isometry3d& T) {
  const std::string path = folder + "/cam" + std::to_string(cam) + "/sensor.yaml";
  std::string text = text_of(path);
  std::ostringstream data;
  data.precision(17);
  data << "data: [";
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c) data << (r + c > 0 ? ", " : "") << T.matrix()(r, c);
  const std::size_t from = text.find("data: [");
  std::ofstream(path) << text.replace(from, text.find(']', from) - from, data.str());
}

StereoRig sample() {
  return *read_rig(test::rig_recording());
}

/// rig.yaml places cam0; which body the cameras were calibrated in must not matter.
TEST(Calibration, IsTheSameInWhateverBodyFrameTheCamerasAreGiven) {
  StereoRig rig = sample();
  rig.T_left_right.rotate(Eigen::AngleAxisd(0.02, Eigen::Vector3d(0.6, 0.64, 0.48)));
  rig.T_map_camera_at_zero.rotate(Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitX()));
  const TempFolder folder;
  ASSERT_TRUE(write_rig(rig, folder.path(), 10));
  for (int turn = 0; turn < 12; ++turn) {
    Eigen::Isometry3d T_body_left = Eigen::Isometry3d::Identity();
    T_body_left.rotate(Eigen::AngleAxisd(turn, Eigen::Vector3d(1, turn, 3).normalized()));
    T_body_left.translation() = Eigen::Vector3d(0.3 * turn, -1.5, 0.02);
    set_body(folder.path(), 0, T_body_left);
    set_body(folder.path(), 1, T_body_left * rig.T_left_right);
    const auto read = read_rig(folder.path());
    ASSERT_TRUE(read) << read.error().text();
    EXPECT_TRUE(read->T_left_right.isApprox(rig.T_left_right, 1e-9));
    EXPECT_TRUE(read->T_map_camera_at_zero.isApprox(rig.T_map_camera_at_zero, 1e-9));
    EXPECT_NEAR(read->camera_height_m(), 1.95, 1e-9);
    EXPECT_NEAR(read->baseline_m(), 0.12, 1e-9);
  }
}

TEST(Calibration, ReadsBackAsWritten) {
  StereoRig rig = sample();
  rig.left.bits = 12;
  rig.left.k1 = -0.2;
  const TempFolder folder;
  ASSERT_TRUE(write_rig(rig, folder.path(), 10));
  const auto read = read_rig(folder.path());
  ASSERT_TRUE(read) << read.error().text();
  EXPECT_EQ(read->left.bits, 12);
  EXPECT_EQ(read->right.bits, 0);
  EXPECT_EQ(read->left.k1, -0.2);
  EXPECT_TRUE(read->T_left_right.isApprox(rig.T_left_right, 1e-12));
}

struct Spoilt {
  const char* says;  ///< what the error must hold
  std::function<void(StereoRig&)> spoil;
};

void expect_refused(const std::vector<Spoilt>& cases) {
  for (const Spoilt& c : cases) {
    StereoRig rig = sample();
    c.spoil(rig);
    const auto checked = check_rig(rig, "rig");
    ASSERT_FALSE(checked) << c.says;
    EXPECT_NE(checked.error().text().find(c.says), std::string::npos) << checked.error().text();
    EXPECT_FALSE(checked.error().todo.empty());
  }
}

TEST(CheckRig, NamesLengthsThatAreNotInMetres) {
  expect_refused({
      {"baseline 120 m", [](StereoRig& r) { r.T_left_right.translation() *= 1000; }},
      {"baseline 12 m", [](StereoRig& r) { r.T_left_right.translation() *= 100; }},
      {"baseline 0.00012 m", [](StereoRig& r) { r.T_left_right.translation() /= 1000; }},
      {"camera height 1950 m",
       [](StereoRig& r) { r.T_map_camera_at_zero.translation().z() *= 1000; }},
      {"camera height 195 m",
       [](StereoRig& r) { r.T_map_camera_at_zero.translation().z() *= 100; }},
      {"35000 m from where",
       [](StereoRig& r) { r.T_map_camera_at_zero.translation().x() = 35'000; }},
      {"baseline 1.2 m and camera height 0.5 m",
       [](StereoRig& r) {
         r.T_left_right.translation() *= 10;
         r.T_map_camera_at_zero.translation().z() = 0.5;
       }},
      {"a disparity of", [](StereoRig& r) { r.T_map_camera_at_zero.translation().z() = 90; }},
      {"not above the floor",
       [](StereoRig& r) { r.T_map_camera_at_zero.translation().z() = -1.95; }},
  });
}

TEST(CheckRig, NamesIntrinsicsOfAnotherImage) {
  const auto both = [](StereoRig& r, const std::function<void(CameraModel&)>& change) {
    change(r.left);
    change(r.right);
  };
  expect_refused({
      // Calibrated at one resolution, recorded at another.
      {"the middle of one of 640 x 360",
       [&](StereoRig& r) { both(r, [](CameraModel& c) { c.cx_px = 319.5, c.cy_px = 179.5; }); }},
      {"the middle of one of 1920 x 1080",
       [&](StereoRig& r) { both(r, [](CameraModel& c) { c.cx_px = 959.5, c.cy_px = 539.5; }); }},
      {"the middle of one of 1024 x 576",
       [&](StereoRig& r) { both(r, [](CameraModel& c) { c.cx_px = 511.5, c.cy_px = 287.5; }); }},
      {"cam1 has its principal point at (1300", [](StereoRig& r) { r.right.cx_px = 1300; }},
      {"cam0 has its principal point at (639.5, -3), outside",
       [](StereoRig& r) { r.left.cy_px = -3; }},
      {"far from the middle", [](StereoRig& r) { r.left.cx_px = 1000; }},
      {"the focal lengths of cam0 and cam1 differ",
       [](StereoRig& r) { r.right.fx_px = r.right.fy_px = 350; }},
      {"focal lengths that differ", [](StereoRig& r) { r.left.fy_px = 359.5; }},
      {"a focal length of 0.7 px", [](StereoRig& r) { r.left.fx_px = r.left.fy_px = 0.7; }},
      {"a focal length of -700 px", [](StereoRig& r) { r.left.fx_px = -700; }},
      {"not finite", [](StereoRig& r) { r.left.k1 = std::nan(""); }},
      {"folds the image", [](StereoRig& r) { r.left.k1 = -1.5; }},
      {"folds the image", [](StereoRig& r) { r.left.p1 = -0.28; }},
      {"differ in resolution", [](StereoRig& r) { r.right.width = 1279; }},
  });
}

TEST(CheckRig, NamesMatricesThatDoNotOnlyTurn) {
  expect_refused({
      {"T_world_cam0 is not a rotation matrix: it mirrors",
       [](StereoRig& r) { r.T_map_camera_at_zero.linear().col(0) *= -1; }},
      {"T_BS is not a rotation matrix: it mirrors",
       [](StereoRig& r) { r.T_left_right.linear().row(1) *= -1; }},
      {"T_world_cam0 is not a rotation matrix: its rows are not of length 1",
       [](StereoRig& r) { r.T_map_camera_at_zero.linear() *= 1.01; }},
      {"T_BS is not a rotation matrix", [](StereoRig& r) { r.T_left_right.linear()(0, 1) = 0.1; }},
      {"does not look down",
       [](StereoRig& r) { r.T_map_camera_at_zero.linear() = Eigen::Matrix3d::Identity(); }},
      {"the wrong way round", [](StereoRig& r) { r.T_left_right = r.T_left_right.inverse(); }},
  });
}

/// Real calibrations are not tidy: these must pass.
TEST(CheckRig, TakesOrdinaryLensesAndMounts) {
  const auto good = [](const std::function<void(StereoRig&)>& change) {
    StereoRig rig = sample();
    change(rig);
    const auto checked = check_rig(rig, "rig");
    EXPECT_TRUE(checked) << checked.error().text();
  };
  good([](StereoRig& r) {  // EuRoC's cam0
    r.left = r.right = {752,     480,         458.654,    457.296,    367.215,
                        248.375, -0.28340811, 0.07395907, 0.00019359, 1.76187114e-05};
  });
  good([](StereoRig& r) { r.left.cx_px = 700, r.left.cy_px = 330; });  // off the middle
  good([](StereoRig& r) { r.left.cx_px = r.right.cx_px = 850; });      // cropped on one side
  good([](StereoRig& r) { r.left.k1 = 0.1, r.left.k2 = -0.05; });
  good([](StereoRig& r) { r.T_map_camera_at_zero.translation() = Eigen::Vector3d(40, -12, 30); });
  good([](StereoRig& r) {  // five degrees of tilt, digits cut as in a report
    r.T_map_camera_at_zero.linear() << 1, 0, 0, 0, -0.9962, -0.0872, 0, 0.0872, -0.9962;
  });
}

/// As OpenCV (5, 8, 12 or 14 numbers) and ROS (5) write a lens that was calibrated with four or five of its coefficients.
TEST(Calibration, ReadsCoefficientsThatAreZeroBehindThoseThatCount) {
  const TempFolder folder;
  StereoRig rig = sample();
  rig.left.k1 = -0.1;
  rig.left.p2 = 0.001;
  ASSERT_TRUE(write_rig(rig, folder.path(), 10));
  const std::string path = folder / "cam0/sensor.yaml";
  const std::string good = text_of(path);
  const auto with = [&](const std::string& model, const std::string& more) {
    std::string text = good;
    const std::string name = "radial-tangential";
    text.replace(text.find(name), name.size(), model);
    text.insert(text.find(']', text.find("distortion_coefficients")), more);
    std::ofstream(path) << text;
    return read_rig(folder.path());
  };
  for (const char* model : {"plumb_bob", "radtan", "radial-tangential"})
    for (const char* more : {"", ", 0", ", 0.0, 0, 0, 0", ", 0, 0, 0, 0, 0, 0, 0, 0, 0, 0"}) {
      const auto read = with(model, more);
      ASSERT_TRUE(read) << model << more << ": " << read.error().text();
      EXPECT_EQ(read->left.k1, -0.1);
      EXPECT_EQ(read->left.p2, 0.001);
    }
  const auto k3 = with("plumb_bob", ", 0.02");
  ASSERT_TRUE(k3) << k3.error().text();
  EXPECT_EQ(k3->left.k3, 0.02);
  const auto k4 = with("plumb_bob", ", 0, 0.02");
  ASSERT_FALSE(k4);
  EXPECT_NE(k4.error().what.find("number 6 is not 0"), std::string::npos) << k4.error().text();
  EXPECT_FALSE(with("plumb_bob", ", 0, 0, 0, 1e-9"));
  EXPECT_FALSE(with("rational_polynomial", ", 0"));
  EXPECT_FALSE(with("plumb_bob", ", 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0"));  // more than anybody has
}

}  // namespace
}  // namespace crane
