// SPDX-License-Identifier: Apache-2.0
// Each format against an asymmetrical rig, so that a transform taken for its inverse, or a
// millimetre for a metre, shows; OpenCV judges its own format.

#include "calibration_files/calibration_files.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <locale>
#include <opencv2/calib3d.hpp>
#include <sstream>

#include "temp_folder.hpp"

namespace crane {
namespace {

using test::TempFolder;
using ::testing::HasSubstr;
using F = CalibrationFormat;

/// Turned about all three axes by different angles, shifted along all three by different lengths.
StereoRig asymmetrical(LensModel lens) {
  StereoRig rig;
  rig.left = {1280, 720, 701.25, 699.5, 640.125, 355.0625, -0.17, 0.026, 4e-4, -7e-5};
  rig.right = {1280, 720, 702.75, 700.5, 652.3, 361.7, -0.171, 0.0259, 1.0 / 3000, 2e-4};
  for (CameraModel* c : {&rig.left, &rig.right}) {
    c->lens = lens;
    if (lens == LensModel::kEquidistant) c->p1 = c->p2 = 0, c->k3 = -1e-3, c->k4 = 2e-4;
    if (lens == LensModel::kRational) c->k3 = 1e-3, c->k4 = 0.02, c->k5 = -3e-3, c->k6 = 1e-4;
  }
  rig.T_left_right.linear() = (Eigen::AngleAxisd(0.011, Eigen::Vector3d::UnitX()) *
                               Eigen::AngleAxisd(-0.027, Eigen::Vector3d::UnitY()) *
                               Eigen::AngleAxisd(0.005, Eigen::Vector3d::UnitZ()))
                                  .toRotationMatrix();
  rig.T_left_right.translation() = Eigen::Vector3d(0.1197, 0.0021, -0.0034);
  rig.T_map_camera_at_zero.linear() = Eigen::Vector3d(1, -1, -1).asDiagonal();
  rig.T_map_camera_at_zero.translation().z() = 9.4;
  return rig;
}

StereoRig with_k3() {
  StereoRig rig = asymmetrical(LensModel::kRadialTangential);
  rig.left.k3 = rig.right.k3 = 0.004;
  return rig;
}

void expect_same(const StereoRig& a, const StereoRig& b) {
  EXPECT_LT((a.T_left_right.matrix() - b.T_left_right.matrix()).cwiseAbs().maxCoeff(), 1e-9);
  for (const auto eye : {&StereoRig::left, &StereoRig::right}) {
    const CameraModel& c = a.*eye;
    const CameraModel& d = b.*eye;
    EXPECT_EQ(c.width, d.width);
    EXPECT_EQ(c.height, d.height);
    EXPECT_EQ(c.lens, d.lens);
    for (const auto number :
         {&CameraModel::fx_px, &CameraModel::fy_px, &CameraModel::cx_px, &CameraModel::cy_px,
          &CameraModel::k1, &CameraModel::k2, &CameraModel::p1, &CameraModel::p2, &CameraModel::k3,
          &CameraModel::k4, &CameraModel::k5, &CameraModel::k6})
      EXPECT_NEAR(c.*number, d.*number, 1e-9);
  }
}

/// Writes, reads back without a word of what it is, and compares.
void round_trip(const StereoRig& rig, F format) {
  SCOPED_TRACE(kCalibrationFormats[static_cast<int>(format)]);
  const TempFolder folder;
  const auto written = write_calibration(rig, true, format, folder / "out");
  ASSERT_TRUE(written) << written.error().text();
  const auto read = read_calibration({folder / "out"}, std::nullopt, {});
  ASSERT_TRUE(read) << read.error().text();
  EXPECT_EQ(read->format, format);
  expect_same(read->rig, rig);
}

std::string refused(const StereoRig& rig, F format) {
  const TempFolder folder;
  const auto written = write_calibration(rig, true, format, folder / "out");
  EXPECT_FALSE(written);
  EXPECT_FALSE(std::filesystem::exists(folder / "out"));
  return written ? "" : written.error().text();
}

const F kWritten[] = {F::kCranemap, F::kEuroc,     F::kKalibr, F::kRos,
                      F::kOpencv,   F::kOpencvXml, F::kZed,    F::kOrbSlam};

TEST(CalibrationFiles, EachFormatKeepsWhatItHoldsToANanometre) {
  for (const F format : kWritten) round_trip(asymmetrical(LensModel::kRadialTangential), format);
  for (const F format : {F::kCranemap, F::kRos, F::kOpencv, F::kOpencvXml, F::kZed, F::kOrbSlam})
    round_trip(with_k3(), format);
  for (const F format : {F::kCranemap, F::kRos, F::kOpencv, F::kOpencvXml, F::kZed})
    round_trip(asymmetrical(LensModel::kRational), format);
  for (const F format : {F::kCranemap, F::kKalibr, F::kRos, F::kOrbSlam, F::kZed})
    round_trip(asymmetrical(LensModel::kEquidistant), format);
}

TEST(CalibrationFiles, WhatAFormatCannotHoldIsRefusedNotDropped) {
  const StereoRig rational = asymmetrical(LensModel::kRational);
  for (const F format : {F::kEuroc, F::kKalibr, F::kOrbSlam})
    EXPECT_THAT(refused(rational, format), HasSubstr("rational lens"));
  for (const F format : {F::kEuroc, F::kKalibr})
    EXPECT_THAT(refused(with_k3(), format), HasSubstr("k3"));
  for (const F format : {F::kEuroc, F::kOpencv, F::kOpencvXml})
    EXPECT_THAT(refused(asymmetrical(LensModel::kEquidistant), format), HasSubstr("equidistant"));
  EXPECT_THAT(refused(rational, F::kMrcal), HasSubstr("only read"));
  StereoRig odd = rational;
  odd.left.width = odd.right.width = 1300;
  EXPECT_THAT(refused(odd, F::kZed), HasSubstr("1300"));
  const TempFolder folder;
  const auto unmounted = write_calibration(rational, false, F::kCranemap, folder / "out");
  ASSERT_FALSE(unmounted);
  EXPECT_THAT(unmounted.error().text(), HasSubstr("--height"));
}

/// Numbers with a decimal comma and dots between thousands.
struct German : std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
  char do_thousands_sep() const override { return '.'; }
  std::string do_grouping() const override { return "\3"; }
};

TEST(CalibrationFiles, NoLocaleGetsIntoAFile) {
  // Of C as well, as GStreamer sets it in a program. Made here: images of machines have none.
  const TempFolder made;
  ASSERT_EQ(std::system(("localedef -i de_DE -f UTF-8 " + made / "de_DE.UTF-8" + " 2>&1").c_str()),
            0)
      << "package locales (deploy/install-deps)";
  setenv("LOCPATH", made.path().c_str(), 1);
  ASSERT_NE(setlocale(LC_ALL, "de_DE.UTF-8"), nullptr);
  const std::locale before = std::locale::global(std::locale(std::locale::classic(), new German));
  char comma[8];
  std::snprintf(comma, sizeof comma, "%.1f", 0.5);
  EXPECT_STREQ(comma, "0,5");
  for (const F format : kWritten) round_trip(asymmetrical(LensModel::kRadialTangential), format);
  std::locale::global(before);
  setlocale(LC_ALL, "C");
  unsetenv("LOCPATH");
}

cv::Mat matrix(const std::vector<double>& values, int rows) {
  return cv::Mat(values, true).reshape(1, rows);
}

/// What the sample stereo_calib writes, by OpenCV itself.
void write_as_sample(const StereoRig& rig, const std::string& intrinsics,
                     const std::string& extrinsics) {
  cv::FileStorage in(intrinsics, cv::FileStorage::WRITE);
  for (const bool right : {false, true}) {
    const CameraModel& c = right ? rig.right : rig.left;
    in << (right ? "M2" : "M1") << matrix({c.fx_px, 0, c.cx_px, 0, c.fy_px, c.cy_px, 0, 0, 1}, 3)
       << (right ? "D2" : "D1")
       << matrix({c.k1, c.k2, c.p1, c.p2, c.k3, c.k4, c.k5, c.k6, 0, 0, 0, 0, 0, 0}, 1);
  }
  const Eigen::Isometry3d T = rig.T_right_left();
  const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> R = T.linear();
  cv::FileStorage ex(extrinsics, cv::FileStorage::WRITE);
  ex << "R" << matrix({R.data(), R.data() + 9}, 3) << "T"
     << matrix({T.translation().data(), T.translation().data() + 3}, 3);
}

TEST(CalibrationFiles, OpencvItselfReadsWhatIsWrittenAndIsRead) {
  const StereoRig rig = asymmetrical(LensModel::kRational);
  const TempFolder folder;
  for (const std::string end : {".yml", ".xml"}) {
    const std::string in = folder / ("intrinsics" + end), ex = folder / ("extrinsics" + end);
    write_as_sample(rig, in, ex);
    EXPECT_THAT(read_calibration({in, ex}, std::nullopt, {}).error().text(), HasSubstr("--size"));
    const auto read = read_calibration({in, ex}, std::nullopt, {1280, 720});
    ASSERT_TRUE(read) << read.error().text();
    expect_same(read->rig, rig);

    const bool xml = end == ".xml";
    const std::string out = folder / ("out" + end);
    ASSERT_TRUE(write_calibration(rig, true, xml ? F::kOpencvXml : F::kOpencv, out));
    const cv::FileStorage a(out + "/intrinsics" + end, cv::FileStorage::READ);
    const cv::FileStorage b(out + "/extrinsics" + end, cv::FileStorage::READ);
    cv::Mat M1, D2, R, T, R1, P2;
    a["M1"] >> M1;
    a["D2"] >> D2;
    b["R"] >> R;
    b["T"] >> T;
    b["R1"] >> R1;
    b["P2"] >> P2;
    EXPECT_EQ(M1.at<double>(1, 2), rig.left.cy_px);
    EXPECT_EQ(D2.at<double>(7), rig.right.k6);
    // OpenCV: x_right = R x_left + T.
    const Eigen::Vector3d p(0.3, -0.2, 2), q = rig.T_right_left() * p;
    const cv::Mat seen = R * cv::Mat(cv::Vec3d(p.x(), p.y(), p.z())) + T;
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(seen.at<double>(i), q[i], 1e-12);
    EXPECT_LT(P2.at<double>(0, 3), 0);
    EXPECT_EQ(R1.rows, 3);
  }
}

/// A point of the left camera must come to the same row of both rectified images.
TEST(CalibrationFiles, RosRectificationsPutAPointIntoOneRow) {
  const StereoRig rig = asymmetrical(LensModel::kRational);
  const auto rectified = rectification_of(rig, "ROS");
  ASSERT_TRUE(rectified);
  using Rows3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  using Rows4 = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;
  const Eigen::Vector3d p(0.4, 0.3, 1.7), q = rig.T_right_left() * p;
  Eigen::Vector3d pixel[2];
  for (const int side : {0, 1}) {
    const Rows3 R = Eigen::Map<const Rows3>(rectified->R[side].data());
    const Rows4 P = Eigen::Map<const Rows4>(rectified->P[side].data());
    // P of the right camera holds the shift; it is applied to points of the left one.
    const Eigen::Vector3d rotated = R * (side == 0 ? p : q);
    pixel[side] = P.leftCols<3>() * rotated;
    pixel[side] /= pixel[side].z();
  }
  EXPECT_NEAR(pixel[0].y(), pixel[1].y(), 1e-9);
  EXPECT_GT(pixel[0].x(), pixel[1].x());
}

/// Spellings of ten years of cameras; the same camera in all of them.
TEST(CalibrationFiles, ZedFilesOfAllYearsSayTheSame) {
  const std::string eye = "fx=700\nfy=701\ncx=640.5\ncy=360.5\n";
  const std::string lens = "k1=-0.17\nk2=0.027\n";
  const std::string cameras = "[LEFT_CAM_HD]\n" + eye + lens + "[RIGHT_CAM_HD]\n" + eye + lens;
  const std::string stereo = "[STEREO]\nBaseline=119.7\nTY=0.5\nTZ=-0.25\n";
  const std::string turn = "CV_HD=0.01\nRX_HD=-0.002\nRZ_HD=0.003\n";
  const auto read = [](const std::string& text) {
    const auto rig = parse_calibration({{"SN1.conf", text}}, F::kZed, {});
    EXPECT_TRUE(rig) << (rig ? "" : rig.error().text());
    return rig ? rig.value() : StereoRig{};
  };
  const StereoRig rig = read(cameras + stereo + turn);
  EXPECT_NEAR(rig.T_right_left().translation().x(), -0.1197, 1e-12);
  EXPECT_NEAR(rig.T_right_left().translation().y(), 0.0005, 1e-12);
  EXPECT_NEAR(rig.T_right_left().translation().z(), -0.00025, 1e-12);
  EXPECT_NEAR(rig.baseline_m(), 0.1197, 1e-5);
  cv::Mat R;
  cv::Rodrigues(cv::Vec3d(-0.002, 0.01, 0.003), R);
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(rig.T_right_left().linear()(r, c), R.at<double>(r, c), 1e-12);

  const auto with = [](std::string text, const std::string& from, const std::string& to) {
    for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
      text.replace(at, from.size(), to);
    return text;
  };
  const std::string plain = cameras + stereo + turn;
  for (const std::string& same :
       {with(plain, "\n", "\r\n"), with(plain, "=", " = "), "\xEF\xBB\xBF" + plain,
        "# SN1\n" + with(plain, "fy=701\n", "fy=701 ; from the factory\n"),
        with(with(plain, "TY=", "TY_HD="), "TZ=", "TZ_HD="), with(plain, "CV_HD", "CV"),
        with(plain, lens, "k3=0\nk2=0.027\np1=0\np2=0\nk1=-0.17\n"),
        // The lens stands once for all resolutions, and what stands beside is of another model.
        with(plain, lens, "k1=9\nk2=9\n") + "[LEFT_DISTO]\n" + lens + "[RIGHT_DISTO]\n" + lens})
    expect_same(read(same), rig);
  StereoRig rational = rig;
  for (CameraModel* c : {&rational.left, &rational.right})
    c->lens = LensModel::kRational, c->k4 = 0.1, c->k5 = 0.2, c->k6 = 0.3;
  const std::string disto = lens + "k4=0.1\nk5=0.2\nk6=0.3\n";
  expect_same(read(plain + "[LEFT_DISTO]\n" + disto + "[RIGHT_DISTO]\n" + disto), rational);

  // Several resolutions: which one must be told.
  const std::string two = plain + with(with(cameras, "_HD]", "_VGA]"), "fx=700", "fx=350");
  EXPECT_THAT(parse_calibration({{"SN1.conf", two}}, F::kZed, {}).error().text(),
              HasSubstr("--size"));
  EXPECT_TRUE(parse_calibration({{"SN1.conf", two}}, F::kZed, {1280, 720}));
  EXPECT_THAT(parse_calibration({{"SN1.conf", two}}, F::kZed, {640, 480}).error().text(),
              HasSubstr("1280x720, 672x376"));
  EXPECT_THAT(
      parse_calibration({{"SN1.conf", with(plain, "119.7", "119,7")}}, F::kZed, {}).error().text(),
      HasSubstr("SN1.conf:16: '119,7' is not a decimal number"));
}

/// The maker's zed-opencv-calibration calibrates by cv::stereoCalibrate and writes its R and T:
/// views of a board by a known rig, calibrated in the same way, must be read as that rig.
TEST(CalibrationFiles, AZedFileByTheMakersToolIsTheRigThatSawTheBoard) {
  StereoRig truth = asymmetrical(LensModel::kRadialTangential);
  for (CameraModel* c : {&truth.left, &truth.right}) c->k1 = c->k2 = c->p1 = c->p2 = 0;
  const Eigen::Isometry3d T_right_left = truth.T_right_left();
  std::vector<std::vector<cv::Point3f>> board;
  std::vector<std::vector<cv::Point2f>> seen[2];
  for (int view = 0; view < 8; ++view) {
    const Eigen::AngleAxisd turn(
        0.4, Eigen::Vector3d(std::cos(view), std::sin(view), 0.2 * view).normalized());
    board.emplace_back();
    for (auto& s : seen) s.emplace_back();
    for (int i = 0; i < 54; ++i) {
      const Eigen::Vector3d on(40.0 * (i % 9), 40.0 * (i / 9), 0);  // [mm], as the tool has it
      const Eigen::Vector3d p = turn * (1e-3 * on) + Eigen::Vector3d(-0.15, -0.1, 0.7 + 0.1 * view);
      board.back().emplace_back(float(on.x()), float(on.y()), 0.F);
      for (const int side : {0, 1}) {
        const CameraModel& c = side == 0 ? truth.left : truth.right;
        const Eigen::Vector3d q = side == 0 ? p : Eigen::Vector3d(T_right_left * p);
        seen[side].back().emplace_back(float(c.fx_px * q.x() / q.z() + c.cx_px),
                                       float(c.fy_px * q.y() / q.z() + c.cy_px));
      }
    }
  }
  cv::Mat K[2], D[2], R, T, E, F_, turn;
  for (const int side : {0, 1}) {
    const CameraModel& c = side == 0 ? truth.left : truth.right;
    K[side] = (cv::Mat_<double>(3, 3) << c.fx_px, 0, c.cx_px, 0, c.fy_px, c.cy_px, 0, 0, 1);
    D[side] = cv::Mat::zeros(1, 5, CV_64F);
  }
  cv::stereoCalibrate(board, seen[0], seen[1], K[0], D[0], K[1], D[1], {1280, 720}, R, T, E, F_,
                      cv::CALIB_FIX_INTRINSIC);
  cv::Rodrigues(R, turn);
  std::ostringstream text;
  text.precision(12);
  for (const int side : {0, 1})
    text << (side == 0 ? "[LEFT_CAM_HD]" : "[RIGHT_CAM_HD]")
         << "\nfx = " << K[side].at<double>(0, 0) << "\nfy = " << K[side].at<double>(1, 1)
         << "\ncx = " << K[side].at<double>(0, 2) << "\ncy = " << K[side].at<double>(1, 2)
         << "\n\n";
  for (const char* side : {"LEFT", "RIGHT"})
    text << "[" << side
         << "_DISTO]\nk1 = 0\nk2 = 0\np1 = 0\np2 = 0\nk3 = 0\nk4 = 0\nk5 = 0\nk6 = 0\n";
  text << "[STEREO]\nBaseline = " << -T.at<double>(0) << "\nTY = " << T.at<double>(1)
       << "\nTZ = " << T.at<double>(2) << "\nCV_HD = " << turn.at<double>(1)
       << "\nRX_HD = " << turn.at<double>(0) << "\nRZ_HD = " << turn.at<double>(2) << "\n\n";
  const auto read = parse_calibration({{"SN1.conf", text.str()}}, F::kZed, {});
  ASSERT_TRUE(read) << read.error().text();
  const Eigen::Isometry3d off = read.value().T_left_right * truth.T_left_right.inverse();
  EXPECT_LT(Eigen::AngleAxisd(off.linear()).angle(), 1e-5);
  EXPECT_LT(off.translation().norm(), 1e-5);
}

/// A fisheye has k1 to k4 and no p1: read as k4 of a rational lens it would be another camera.
TEST(CalibrationFiles, AZedFisheyeIsEquidistant) {
  const std::string eye = "fx=700\nfy=701\ncx=960.5\ncy=600.5\n";
  const std::string lens = "k1=0.05\nk2=-0.01\nk3=0.002\nk4=-0.0003\n";
  const std::string text = "[LEFT_CAM_FHD1200]\n" + eye + "[RIGHT_CAM_FHD1200]\n" + eye +
                           "[LEFT_DISTO]\n" + lens + "[RIGHT_DISTO]\n" + lens +
                           "[STEREO]\nBaseline=120\nTY=0\nTZ=0\nCV_FHD1200=0\nRX_FHD1200=0\n"
                           "RZ_FHD1200=0\n";
  const auto rig = parse_calibration({{"SN1.conf", text}}, F::kZed, {});
  ASSERT_TRUE(rig) << rig.error().text();
  EXPECT_EQ(rig.value().left.lens, LensModel::kEquidistant);
  EXPECT_EQ(rig.value().right.k3, 0.002);
  EXPECT_EQ(rig.value().right.k4, -0.0003);
}

/// Written by mrcal-from-kalibr and its like; here by hand, with what a real one carries.
std::string cameramodel(const CameraModel& c, const Eigen::Isometry3d& T_camera_reference) {
  std::ostringstream s;
  s.precision(17);
  const Eigen::AngleAxisd turn(T_camera_reference.linear());
  const Eigen::Vector3d r = turn.angle() * turn.axis(), t = T_camera_reference.translation();
  s << "# generated by mrcal\n{\n    'lensmodel':  'LENSMODEL_OPENCV4',\n\n    # intrinsics are fx,"
    << "fy,cx,cy\n    'intrinsics': [ " << c.fx_px << ", " << c.fy_px << ", " << c.cx_px << ", "
    << c.cy_px << ", " << c.k1 << ", " << c.k2 << ", " << c.p1 << ", " << c.p2 << ",],\n"
    << "    'valid_intrinsics_region': [\n    [ 0, 0 ],\n    [ 9, 9 ]\n],\n    'extrinsics': [ "
    << r.x() << ", " << r.y() << ", " << r.z() << ", " << t.x() << ", " << t.y() << ", " << t.z()
    << ",],\n    'imagersize': [ " << c.width << ", " << c.height
    << ",],\n    'icam_intrinsics': 0,\n    'optimization_inputs': b'{P[(#}]:,x',\n}\n";
  return s.str();
}

TEST(CalibrationFiles, MrcalSaysWhereTheReferenceIsInEachCamera) {
  const StereoRig rig = asymmetrical(LensModel::kRadialTangential);
  Eigen::Isometry3d T_left_reference = Eigen::Isometry3d::Identity();
  T_left_reference.rotate(Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, 3).normalized()));
  T_left_reference.translation() = Eigen::Vector3d(1, -2, 0.5);
  const TempFolder folder;
  std::ofstream(folder / "cam-0.cameramodel") << cameramodel(rig.left, T_left_reference);
  std::ofstream(folder / "cam-1.cameramodel")
      << cameramodel(rig.right, rig.T_right_left() * T_left_reference);
  const auto read = read_calibration({folder.path()}, std::nullopt, {});
  ASSERT_TRUE(read) << read.error().text();
  EXPECT_EQ(read->format, F::kMrcal);
  expect_same(read->rig, rig);
}

/// ORB-SLAM2's settings have rectifications instead.
TEST(CalibrationFiles, OrbSlam2IsReadByItsRectifications) {
  const StereoRig rig = asymmetrical(LensModel::kRadialTangential);
  const auto rectified = rectification_of(rig, "ORB-SLAM2");
  ASSERT_TRUE(rectified);
  std::ostringstream s;
  s.precision(17);
  s << "%YAML:1.0\nCamera.fx: 435.2\nCamera.bf: 47.9\n";
  for (const int side : {0, 1}) {
    const CameraModel& c = side == 0 ? rig.left : rig.right;
    const std::string name = side == 0 ? "LEFT." : "RIGHT.";
    const auto write = [&](const char* key, int rows, int columns, const std::vector<double>& m) {
      s << name << key << ": !!opencv-matrix\n   rows: " << rows << "\n   cols: " << columns
        << "\n   dt: d\n   data: [";
      for (std::size_t i = 0; i < m.size(); ++i) s << (i > 0 ? ", " : "") << m[i];
      s << "]\n";
    };
    s << name << "height: 720\n" << name << "width: 1280\n";
    write("D", 1, 5, {c.k1, c.k2, c.p1, c.p2, c.k3});
    write("K", 3, 3, {c.fx_px, 0, c.cx_px, 0, c.fy_px, c.cy_px, 0, 0, 1});
    write("R", 3, 3, rectified->R[side]);
    write("P", 3, 4, rectified->P[side]);
  }
  const auto read = parse_calibration({{"EuRoC.yaml", s.str()}}, F::kOrbSlam, {});
  ASSERT_TRUE(read) << read.error().text();
  expect_same(read.value(), rig);
}

/// The camera of EuRoC's V1 recordings as two others describe it: Kalibr's chain, with each camera
/// in the IMU, and ORB-SLAM2's rectification; keys and values as OpenCV lets them stand together.
TEST(CalibrationFiles, TwoDescriptionsOfOneRealCameraAgree) {
  const std::string lens =
      "  camera_model: pinhole\n  distortion_coeffs: [-0.28340811, 0.07395907, 0.00019359, "
      "1.76187114e-05]\n  distortion_model: radtan\n  intrinsics: [458.654, 457.296, 367.215, "
      "248.375] #fu, fv\n  resolution: [752, 480]\n";
  const auto chain = parse_calibration(
      {{"chain.yaml",
        "%YAML:1.0\n\ncam0:\n  T_imu_cam: #from camera to IMU\n"
        "    - [0.0148655429818, -0.999880929698, 0.00414029679422, -0.0216401454975]\n"
        "    - [0.999557249008, 0.0149672133247, 0.025715529948, -0.064676986768]\n"
        "    - [-0.0257744366974, 0.00375618835797, 0.999660727178, 0.00981073058949]\n"
        "    - [0.0, 0.0, 0.0, 1.0]\n" +
            lens +
            "cam1:\n  T_imu_cam:\n"
            "    - [0.0125552670891, -0.999755099723, 0.0182237714554, -0.0198435579556]\n"
            "    - [0.999598781151, 0.0130119051815, 0.0251588363115, 0.0453689425024]\n"
            "    - [-0.0253898008918, 0.0179005838253, 0.999517347078, 0.00786212447038]\n"
            "    - [0.0, 0.0, 0.0, 1.0]\n" +
            lens}},
      F::kKalibr, {});
  ASSERT_TRUE(chain) << chain.error().text();
  const auto matrix = [](const std::string& name, int rows, int columns, const std::string& data) {
    return name + ": !!opencv-matrix\n   rows: " + std::to_string(rows) +
           "\n   cols: " + std::to_string(columns) + "\n   dt: d\n   data:[" + data + "]\n";
  };
  const std::string K = "458.654, 0.0, 367.215, 0.0, 457.296, 248.375, 0.0, 0.0, 1";
  const std::string D = "-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05, 0.0";
  const std::string P =
      "435.2046959714599, 0, 367.45, 0, 0, 435.2046959714599, 252.2, 0, 0, 0, 1, 0";
  const std::string P2 =
      "435.2046959714599, 0, 367.45, -47.90639384423901, 0, 435.2046959714599, 252.2, 0, 0, 0, 1, "
      "0";
  const auto settings = parse_calibration(
      {{"EuRoC.yaml",
        "%YAML:1.0\n\n#----\nCamera.type: \"PinHole\"\nLEFT.height: 480\nLEFT.width: 752\n" +
            matrix("LEFT.D", 1, 5, D) + matrix("LEFT.K", 3, 3, K) +
            matrix("LEFT.R", 3, 3,
                   "0.999966347530033, -0.001422739138722922, 0.008079580483432283, "
                   "0.001365741834644127, 0.9999741760894847, 0.007055629199258132, "
                   "-0.008089410156878961, -0.007044357138835809, 0.9999424675829176") +
            matrix("LEFT.P", 3, 4, P) + matrix("RIGHT.D", 1, 5, D) + matrix("RIGHT.K", 3, 3, K) +
            matrix("RIGHT.R", 3, 3,
                   "0.9999633526194376, -0.003625811871560086, 0.007755443660172947, "
                   "0.003680398547259526, 0.9999684752771629, -0.007035845251224894, "
                   "-0.007729688520722713, 0.007064130529506649, 0.999945173484644") +
            matrix("RIGHT.P", 3, 4, P2) + "Viewer.PointSize:2\n"}},
      F::kOrbSlam, {});
  ASSERT_TRUE(settings) << settings.error().text();
  const Eigen::Isometry3d& a = chain.value().T_left_right;
  const Eigen::Isometry3d& b = settings.value().T_left_right;
  EXPECT_NEAR(a.translation().norm(), 0.1101, 2e-4);
  EXPECT_LT((a.matrix() - b.matrix()).cwiseAbs().maxCoeff(), 2e-4) << a.matrix() << b.matrix();
  EXPECT_GT(Eigen::AngleAxisd(a.linear()).angle(), 0.01) << "turned: an inverse would show";
}

TEST(CalibrationFiles, EachErrorNamesFileLineAndWhatToDo) {
  const TempFolder folder;
  const StereoRig rig = asymmetrical(LensModel::kRadialTangential);
  const auto spoiled = [&](F format, const std::string& file, const std::string& from,
                           const std::string& to) {
    static int n = 0;
    const std::string out = folder / std::to_string(++n);
    EXPECT_TRUE(write_calibration(rig, true, format, out));
    std::ifstream in(out + "/" + file);
    std::string text{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
    EXPECT_NE(text.find(from), std::string::npos) << text;
    text.replace(text.find(from), from.size(), to);
    std::ofstream(out + "/" + file) << text;
    const auto read = read_calibration({out}, std::nullopt, {});
    EXPECT_FALSE(read);
    if (read) return std::string();
    EXPECT_FALSE(read.error().todo.empty()) << read.error().text();
    return read.error().text();
  };
  EXPECT_THAT(spoiled(F::kKalibr, "camchain.yaml", "pinhole", "omni"),
              HasSubstr("camchain.yaml:3: 'camera_model' is 'omni'"));
  EXPECT_THAT(spoiled(F::kKalibr, "camchain.yaml", "1280, 720", "1280"), HasSubstr(":7:"));
  EXPECT_THAT(spoiled(F::kKalibr, "camchain.yaml", "T_cn_cnm1:", "T_other:"),
              HasSubstr("'T_cn_cnm1' is missing"));
  EXPECT_THAT(spoiled(F::kRos, "right.yaml", "plumb_bob", "brown"), HasSubstr("right.yaml:8:"));
  EXPECT_THAT(spoiled(F::kOpencvXml, "intrinsics.xml", "</M1>", ""), HasSubstr("intrinsics.xml:"));
  EXPECT_THAT(spoiled(F::kOrbSlam, "orb_slam3.yaml", "PinHole", "Rectified"), HasSubstr(":4:"));
  EXPECT_THAT(spoiled(F::kEuroc, "cam1/sensor.yaml", "pinhole", "omni"), HasSubstr("sensor.yaml:"));
  // Millimetres for metres, and left for right.
  EXPECT_THAT(spoiled(F::kOpencv, "extrinsics.yml", "data: [ -0.1", "data: [ -119.1"),
              HasSubstr("baseline"));
  ASSERT_TRUE(write_calibration(rig, true, F::kRos, folder / "ros"));
  EXPECT_THAT(
      read_calibration({folder / "ros/right.yaml", folder / "ros/left.yaml"}, std::nullopt, {})
          .error()
          .text(),
      HasSubstr("the other way round"));
  EXPECT_THAT(read_calibration({folder / "ros/right.yaml"}, std::nullopt, {}).error().text(),
              HasSubstr("name both"));
  EXPECT_THAT(read_calibration({folder / "nowhere"}, std::nullopt, {}).error().text(),
              HasSubstr("nowhere"));
  EXPECT_THAT(read_calibration({CRANEMAP_SOURCE_DIR "/README.md"}, std::nullopt, {}).error().text(),
              HasSubstr("--from"));
}

}  // namespace
}  // namespace crane
