// SPDX-License-Identifier: Apache-2.0
#include "mount_input.hpp"

#include "base/read_file.hpp"
#include "progress.hpp"
#include "recording/calibration.hpp"
#include "service/run_service.hpp"

namespace crane {

Result<SiteConfig> site_of_recording(const std::string& recording, const std::string& config) {
  if (!config.empty()) return read_site_config(config);
  const std::string own = recording + "/site.yaml";
  const auto has_own = is_there(own);
  if (!has_own) return has_own.error();
  return *has_own ? read_site_config(own) : Result<SiteConfig>(SiteConfig{});
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
