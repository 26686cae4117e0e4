// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/site_config.hpp"
#include "emulated_crane.hpp"

namespace crane {

struct LiveDemoOptions {
  std::string scene, out;
  SiteConfig site;  ///< of the services; camera and rangefinders become the emulated ones
  double rate_hz = 1, speed_mps = 0;
};

/// `cranemap demo --live`: a whole crane without hardware. Its camera and rangefinders are emulated
/// and go through the real drivers, services and DDS into the map, which is judged by the truth of
/// the scene. Results as of a run. Returns the exit code.
int run_live_demo(const LiveDemoOptions& options);

}  // namespace crane
