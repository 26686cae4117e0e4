// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <cstdio>
#include <map>

#include "base/log.hpp"
#include "calibrate_command.hpp"
#include "calibration_files/calibration_files.hpp"
#include "service/exit_code.hpp"

namespace crane {
namespace {

struct Options {
  std::vector<std::string> in;
  std::string from, to, out, size;
  double height_m = 0;
};

int fail(const Error& error) {
  log_error(error.text());
  return exit_code(error);
}

CalibrationFormat named(const std::string& name) {
  int i = 0;
  while (name != kCalibrationFormats[i]) ++i;  // CLI::IsMember let nothing else in
  return static_cast<CalibrationFormat>(i);
}

Result<AskedSize> size_of(const std::string& text) {
  AskedSize size;
  int end = 0;
  if (text.empty()) return size;
  if (std::sscanf(text.c_str(), "%5ux%5u%n", &size.width, &size.height, &end) == 2 &&
      std::size_t(end) == text.size())
    return size;
  return Error{ErrorCode::kConfiguration, "--size", "'" + text + "' is not WIDTHxHEIGHT",
               "write 1280x720"};
}

int convert(const Options& o) {
  const auto size = size_of(o.size);
  if (!size) return fail(size.error());
  std::optional<CalibrationFormat> from;
  if (!o.from.empty()) from = named(o.from);
  auto read = read_calibration(o.in, from, size.value());
  if (!read) return fail(read.error());
  StereoRig& rig = read->rig;
  const CalibrationFormat to = named(o.to);
  const bool told = read->mounted || o.height_m > 0;
  if (o.height_m > 0) {
    rig.T_map_camera_at_zero = Eigen::Isometry3d::Identity();
    rig.T_map_camera_at_zero.linear() = Eigen::Vector3d(1, -1, -1).asDiagonal();
    rig.T_map_camera_at_zero.translation().z() = o.height_m;
  }
  const auto files = write_calibration(rig, told, to, o.out);
  if (!files) return fail(files.error());
  std::printf("read as %s: %u x %u, f %.2f and %.2f px, baseline %.3f mm\n",
              kCalibrationFormats[static_cast<int>(read->format)], rig.left.width, rig.left.height,
              rig.left.fx_px, rig.right.fx_px, 1000 * rig.baseline_m());
  for (const std::string& file : files.value())
    std::printf("wrote %s/%s\n", o.out.c_str(), file.c_str());
  if (read->mounted && to != CalibrationFormat::kCranemap)
    std::printf("where the camera hangs stays in %s/rig.yaml: no other format has it\n",
                o.in[0].c_str());
  return kExitOk;
}

}  // namespace

std::function<int()> add_convert_command(CLI::App& app) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand(
      "convert",
      "A stereo calibration from one program's format to another's. What the other cannot hold is\n"
      "refused.\n"
      "Example: cranemap calibration convert SN1010.conf --size 1280x720 --to cranemap --height "
      "9.4 "
      "--out calibration");
  const std::vector<std::string> formats(std::begin(kCalibrationFormats),
                                         std::end(kCalibrationFormats));
  command
      ->add_option("IN", options->in,
                   "Folder or file; or two files, left and right, or intrinsics and extrinsics")
      ->required()
      ->expected(1, 2);
  command->add_option("--from", options->from, "Format of IN, where its content does not tell")
      ->check(CLI::IsMember(formats));
  command->add_option("--to", options->to, "Format to write")
      ->required()
      ->check(CLI::IsMember(formats));
  command->add_option("--out", options->out, "New folder")->required();
  command->add_option(
      "--size", options->size,
      "Of the images, WIDTHxHEIGHT: OpenCV's files may lack it, ZED's hold several");
  command
      ->add_option("--height", options->height_m,
                   "Of the camera above the floor [m], for --to cranemap; it is taken to look "
                   "straight down")
      ->check(CLI::Range(0.3, 100.0));
  return [options] { return convert(*options); };
}

}  // namespace crane
