// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "config/site_config.hpp"
#include "mount/drive.hpp"

namespace crane {

/// The file that site_of_recording() reads, as it is; empty: there is none.
Result<std::string> site_text(const std::string& recording, const std::string& config);
/// `config`, or the recording's own site.yaml, or the defaults. Error: Configuration.
Result<SiteConfig> site_of_recording(const std::string& recording, const std::string& config);

/// Reads a drive and says how far it is; `calibration`: over the recording's own, empty: that.
/// Error: of recording, calibration, images; NotAvailable when stopped.
Result<Drive> drive_of(const std::string& recording, const std::string& calibration);

}  // namespace crane
