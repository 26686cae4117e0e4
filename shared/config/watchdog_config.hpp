// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace crane {

class KeyVisitor;

/// Section `watchdog`: does what the camera sees agree with calibration and positions? From
/// `drifting` on it is said; from `wrong` on no frame is used and the map is not valid.
struct WatchdogConfig {
  bool enabled = true;
  double height_drifting_percent = 0.4, height_wrong_percent = 0.7;
  double tilt_drifting_deg = 0.15, tilt_wrong_deg = 0.3;
  double roll_drifting_deg = 0.05, roll_wrong_deg = 0.1;
  double rows_drifting_px = 0.5, rows_wrong_px = 1;
  double scale_drifting_percent = 0.3, scale_wrong_percent = 0.6;
  double turn_drifting_deg = 0.075, turn_wrong_deg = 0.14;
  double delay_drifting_ms = 20, delay_wrong_ms = 35;
  double jump_m = 0.03;
};
void keys(KeyVisitor& v, WatchdogConfig& c);

}  // namespace crane
