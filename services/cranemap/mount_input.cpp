// SPDX-License-Identifier: Apache-2.0
#include "mount_input.hpp"

#include "base/read_file.hpp"
#include "progress.hpp"
#include "recording/calibration.hpp"
#include "service/run_service.hpp"

namespace crane {

constexpr std::uint64_t kMostBytes = 1 << 20;  // as YamlReader has it

Result<std::string> site_text(const std::string& recording, const std::string& config) {
  const std::string own = recording + "/site.yaml";
  if (config.empty()) {
    const auto has_own = is_there(own);
    if (!has_own) return has_own.error();
    if (!*has_own) return std::string();
  }
  return read_file(config.empty() ? own : config, kMostBytes);
}

Result<SiteConfig> site_of_recording(const std::string& recording, const std::string& config) {
  const auto text = site_text(recording, config);
  if (!text) return text.error();
  if (text->empty() && config.empty()) return SiteConfig{};
  return parse_site_config(*text, config.empty() ? recording + "/site.yaml" : config);
}

Result<Drive> drive_of(const std::string& folder, const std::string& calibration) {
  auto recording = Recording::open(folder);
  if (!recording) return recording.error();
  StereoRig rig = recording->rig();
  if (!calibration.empty()) {
    auto read = read_rig(calibration);
    if (!read) return read.error();
    rig = *read;
  }
  Progress progress("following the floor");
  auto drive = read_drive(*recording, rig, [&](std::size_t done, std::size_t total) {
    progress.update(done, total, "frames");
    return !stop_requested();
  });
  if (drive) progress.finish(std::to_string(drive->tracks) + " points followed");
  return drive;
}

}  // namespace crane
