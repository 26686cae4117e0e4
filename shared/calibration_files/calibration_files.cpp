// SPDX-License-Identifier: Apache-2.0
#include "calibration_files/calibration_files.hpp"

#include <algorithm>
#include <filesystem>

#include "base/read_file.hpp"
#include "base/write_file.hpp"
#include "recording/calibration.hpp"

namespace crane {
namespace {

namespace fs = std::filesystem;

/// A .cameramodel carries all that it was optimised from.
constexpr std::uint64_t kMostBytes = 16U << 20U;
constexpr double kRate_Hz = 10;
constexpr double kStandIn_m = 5;  ///< height, where a file tells none

Error bad(const std::string& where, const std::string& what, const std::string& todo) {
  return {ErrorCode::kConfiguration, where, what, todo};
}

bool is_file(const fs::path& path) {
  std::error_code failed;
  return fs::is_regular_file(path, failed);
}

std::vector<std::string> files_ending(const fs::path& folder, const std::string& end) {
  std::vector<std::string> out;
  std::error_code failed;
  for (fs::directory_iterator at(folder, failed), last; !failed && at != last; at.increment(failed))
    if (at->path().filename().string().ends_with(end)) out.push_back(at->path());
  std::sort(out.begin(), out.end());
  return out;
}

/// The files of a calibration that lies in a folder.
Result<std::vector<std::string>> files_in(const std::string& folder) {
  const fs::path at(folder);
  using Names = std::vector<std::string>;
  for (const auto& [first, second] :
       {std::pair{"cam0/sensor.yaml", "cam1/sensor.yaml"}, std::pair{"left.yaml", "right.yaml"},
        std::pair{"intrinsics.yml", "extrinsics.yml"},
        std::pair{"intrinsics.xml", "extrinsics.xml"}})
    if (is_file(at / first) && is_file(at / second)) return Names{at / first, at / second};
  for (const auto& [end, count] : {std::pair{".cameramodel", 2U}, std::pair{".conf", 1U},
                                   std::pair{"camchain.yaml", 1U}, std::pair{"orb_slam3.yaml", 1U}})
    if (const auto found = files_ending(at, end); found.size() == count) return found;
  return bad(folder, "holds no calibration that is known",
             "name its file, or both: cranemap calibration convert left.yaml right.yaml ...");
}

std::optional<CalibrationFormat> format_of(const Texts& texts) {
  const auto named = [&](const char* end) { return texts[0].name.ends_with(end); };
  const auto holds = [&](const char* word) {
    return std::any_of(texts.begin(), texts.end(), [word](const NamedText& t) {
      return t.text.find(word) != std::string::npos;
    });
  };
  using F = CalibrationFormat;
  if (named(".cameramodel")) return F::kMrcal;
  if (named(".conf") || holds("[STEREO]")) return F::kZed;
  if (holds("LEFT.K") || holds("Camera1.fx") || holds("Camera.type")) return F::kOrbSlam;
  if (holds("T_BS")) return F::kEuroc;
  if (holds("T_cn_cnm1") || holds("cam0:")) return F::kKalibr;
  if (holds("image_width:") && holds("camera_matrix")) return F::kRos;
  if (holds("<opencv_storage>")) return F::kOpencvXml;
  if (holds("M1:")) return F::kOpencv;
  return std::nullopt;
}

/// Whether two cameras can be so; where nothing says how they hang, as if they looked straight
/// down.
Result<void> check(StereoRig rig, bool mounted, const std::string& where) {
  if (!mounted) {
    rig.T_map_camera_at_zero = Eigen::Isometry3d::Identity();
    rig.T_map_camera_at_zero.linear() = Eigen::Vector3d(1, -1, -1).asDiagonal();
    rig.T_map_camera_at_zero.translation().z() = kStandIn_m;
  }
  if (auto turned = check_rotation(rig.T_left_right.linear(), where, "the cameras' relation");
      !turned)
    return turned;
  return check_rig(rig, where);
}

}  // namespace

Result<StereoRig> parse_calibration(const Texts& texts, CalibrationFormat format,
                                    const AskedSize& size) {
  using F = CalibrationFormat;
  const bool two =
      format == F::kCranemap || format == F::kEuroc || format == F::kRos || format == F::kMrcal;
  const std::size_t most = two || format == F::kOpencv || format == F::kOpencvXml ? 2 : 1;
  if (texts.empty() || texts.size() > most || (two && texts.size() != 2))
    return bad(texts.empty() ? "" : texts[0].name,
               std::string("is ") + (texts.size() == 1 ? "one file" : "more than one file") +
                   "; a calibration of format " + kCalibrationFormats[static_cast<int>(format)] +
                   " is in " + (most == 2 ? "two" : "one"),
               two ? "name both: first the left camera's, then the right one's" : "");
  switch (format) {
    case F::kCranemap:
    case F::kEuroc:
      return read_euroc(texts);
    case F::kKalibr:
      return read_kalibr(texts);
    case F::kRos:
      return read_ros(texts);
    case F::kOpencv:
    case F::kOpencvXml:
      return read_opencv(texts, size);
    case F::kZed:
      return read_zed(texts, size);
    case F::kOrbSlam:
      return read_orb_slam(texts);
    case F::kMrcal:
      return read_mrcal(texts);
  }
  return bad(texts[0].name, "is of no format that is known", "");
}

Result<CalibrationFile> read_calibration(const std::vector<std::string>& paths,
                                         std::optional<CalibrationFormat> format,
                                         const AskedSize& size) {
  std::vector<std::string> files = paths;
  const auto folder = is_folder(paths[0]);
  if (!folder) return folder.error();
  CalibrationFile out;
  if (folder.value() && paths.size() == 1) {
    const bool ours = is_file(fs::path(paths[0]) / "rig.yaml");
    if (ours && (!format || format == CalibrationFormat::kCranemap)) {
      auto rig = read_rig(paths[0]);
      if (!rig) return rig.error();
      return CalibrationFile{rig.value(), CalibrationFormat::kCranemap, true};
    }
    auto found = files_in(paths[0]);
    if (!found) return found.error();
    files = found.value();
  }
  Texts texts;
  for (const std::string& file : files) {
    auto text = read_file(file, kMostBytes);
    if (!text) {
      Error error = text.error();
      if (error.code == ErrorCode::kNotAvailable) error.code = ErrorCode::kConfiguration;
      if (error.todo.empty()) error.todo = "name a calibration's file or folder";
      return error;
    }
    texts.push_back({file, std::move(text.value())});
  }
  if (!format) format = format_of(texts);
  if (!format)
    return bad(files[0], "is of no format that is known", "say which one it is: --from FORMAT");
  auto rig = parse_calibration(texts, *format, size);
  if (!rig) return rig.error();
  if (auto possible = check(rig.value(), false, files[0]); !possible) return possible.error();
  return CalibrationFile{rig.value(), *format, false};
}

Result<std::vector<std::string>> write_calibration(const StereoRig& rig, bool mount_told,
                                                   CalibrationFormat format,
                                                   const std::string& folder) {
  using F = CalibrationFormat;
  std::error_code failed;
  if (!fs::is_empty(folder, failed) && !failed)
    return bad(folder, "is not empty", "give --out a new folder");
  if (format == F::kCranemap) {
    if (!mount_told)
      return bad("rig.yaml", "would have to say how high the camera hangs, and nothing tells it",
                 "give --height; 'cranemap calibrate mount' measures it");
    if (auto usable = check(rig, true, folder); !usable) return usable.error();
    if (auto done = write_rig(rig, folder, kRate_Hz); !done) return done.error();
    return std::vector<std::string>{"cam0/sensor.yaml", "cam1/sensor.yaml", "rig.yaml"};
  }
  auto texts = format == F::kEuroc     ? write_euroc(rig)
               : format == F::kKalibr  ? write_kalibr(rig)
               : format == F::kRos     ? write_ros(rig)
               : format == F::kZed     ? write_zed(rig)
               : format == F::kOrbSlam ? write_orb_slam(rig)
               : format == F::kMrcal
                   ? Result<Texts>(bad("mrcal", "is only read, not written",
                                       "write kalibr; mrcal's mrcal-from-kalibr reads that"))
                   : write_opencv(rig, format == F::kOpencvXml);
  if (!texts) return texts.error();
  std::vector<std::string> names;
  for (const NamedText& file : texts.value()) {
    const fs::path path = fs::path(folder) / file.name;
    fs::create_directories(path.parent_path(), failed);
    if (auto done = write_file(path, reinterpret_cast<const std::uint8_t*>(file.text.data()),
                               file.text.size());
        !done)
      return done.error();
    names.push_back(file.name);
  }
  return names;
}

}  // namespace crane
