// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "base/result.hpp"
#include "config/camera_config.hpp"
#include "config/gateway_config.hpp"
#include "config/hoist_config.hpp"
#include "config/http_config.hpp"
#include "config/key_list.hpp"
#include "config/mapper_config.hpp"
#include "config/network_keys.hpp"
#include "config/rangefinder_config.hpp"
#include "config/stereo_config.hpp"
#include "config/watchdog_config.hpp"
#include "config/zone_config.hpp"

namespace crane {

/// One file configures all services of one crane; each service reads its part. Defaults work for
/// the demo. What each key is, its unit and what is allowed: docs/configuration.md, or the function
/// keys() beside each section's struct, which is all there is of it.
struct SiteConfig {
  int crane = 1;
  NetworkSettings dds;
  HttpConfig http;
  GatewayConfig gateway;
  CameraConfig camera;
  StereoConfig stereo;
  MapperConfig mapper;
  HoistConfig hoist;
  std::vector<RangefinderConfig> rangefinders;
  WatchdogConfig watchdog;
  std::vector<ZoneConfig> zones;
};
/// Every key there is.
void keys(KeyVisitor& v, SiteConfig& c);

/// Error: Configuration with every problem of the file, each with its line.
Result<SiteConfig> read_site_config(const std::string& path);
Result<SiteConfig> parse_site_config(const std::string& text, const std::string& name);

/// The effective configuration as YAML; read_site_config() accepts it.
std::string to_yaml(const SiteConfig& config);

/// Every key of it with its value.
std::vector<KeyRow> values_of(SiteConfig config);
/// The keys whose values differ, "mapper.voxel_m", in the order of the file.
std::vector<std::string> changed_keys(const SiteConfig& one, const SiteConfig& other);

}  // namespace crane
