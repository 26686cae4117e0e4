// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "config/site_config.hpp"
#include "mount/mount_calibration.hpp"

namespace crane {

/// Puts what was measured into a site: mapper's directions, offsets, latencies, the scale of each
/// rangefinder, the hook's rest position.
void apply(const MountCalibration& calibration, SiteConfig& site);

/// The same with scales of the devices' own readings: a live site's are multiplied already when
/// they are recorded.
MountCalibration of_devices(MountCalibration calibration, const SiteConfig& site);

/// Every value with its sigma or why it has none, one a line; for terminals and text files.
std::string mount_text(const MountCalibration& calibration);

/// The report as one page without anything from outside. `title`: which crane or recording.
std::string mount_page(const MountCalibration& calibration, const std::string& title);

/// Writes into `folder`: cam0/ cam1/ rig.yaml, site.yaml (`site` with what was measured),
/// commissioning.yaml, mount.txt and mount.html; of a bad one the last two only. `site_text`: the
/// file that `site` was read from, whose comments are kept; empty: there is none. Error: Resource;
/// Configuration, of with_values().
Result<void> write_mount(const MountCalibration& calibration, const SiteConfig& site,
                         const std::string& site_text, const std::string& title,
                         const std::string& folder);

}  // namespace crane
