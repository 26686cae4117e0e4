// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "bounds.h"
#include "config/site_config.hpp"
#include "dds/topics.hpp"

namespace crane {

/// A zone of the configuration as topics carry it.
inline v1::Zone to_sample(const ZoneConfig& c) {
  v1::Zone z;
  z.id(static_cast<std::uint32_t>(c.id));
  z.kind(c.slow_down ? v1::ZONE_SLOW_DOWN : v1::ZONE_NO_GO);
  z.active(c.active ? 1 : 0);
  z.switchable(c.switchable ? 1 : 0);
  z.z_min_m(c.z_min_m);
  z.z_max_m(c.z_max_m);
  z.name(c.name.c_str());
  for (const ZoneConfig::Corner& corner : c.corners) {
    v1::ZoneCorner p;
    p.x_m(corner.x_m);
    p.y_m(corner.y_m);
    z.corners().push_back(p);
  }
  return z;
}

}  // namespace crane
