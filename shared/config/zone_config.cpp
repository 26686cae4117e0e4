// SPDX-License-Identifier: Apache-2.0
#include "config/zone_config.hpp"

#include "config/key.hpp"
#include "config/yaml_reader.hpp"
#include "geometry/simple_polygon.hpp"

namespace crane {
namespace {

constexpr std::size_t kFewestCorners = 3, kMostCorners = 32;

std::string outline_flaw(const ZoneConfig& z) {
  std::vector<Corner> outline;
  for (const ZoneConfig::Corner& c : z.corners) outline.push_back({c.x_m, c.y_m});
  return polygon_flaw(outline);
}

void check(YamlReader& y, const ZoneConfig& z) {
  if (z.corners.size() < kFewestCorners) {
    y.problem("corners", "must be 3 to 32 of {x: .., y: ..}");
  } else if (z.corners.size() <= kMostCorners) {
    if (const std::string flaw = outline_flaw(z); !flaw.empty())
      y.problem("corners", "of zone " + std::to_string(z.id) + ": the outline " + flaw);
  }
  if (z.z_min_m >= z.z_max_m) y.problem("z_min_m", "must be less than z_max_m");
}

}  // namespace

static void keys(KeyVisitor& v, ZoneConfig::Corner& c) {
  v.number(Key("x", "in the map").in("m").required(), c.x_m, {-9e4, 9e4});
  v.number(Key("y", "in the map").in("m").required(), c.y_m, {-9e4, 9e4});
}

static void keys(KeyVisitor& v, ZoneConfig& z) {
  v.integer(Key("id", "by which it is switched; each has its own").required(), z.id,
            {1, 1'000'000});
  v.text({"name", "for people"}, z.name, 63);
  v.choice({"kind", "no-go: clearance is blocked there; slow-down: said"}, z.slow_down,
           {"no-go", "slow-down"});
  v.flag({"active", "at the start"}, z.active);
  v.flag({"switchable", "by topic zone_command and 'cranemap zone'"}, z.switchable);
  v.number({"z_min_m", "from this height on"}, z.z_min_m, {-100, 1000});
  v.number({"z_max_m", "up to this height"}, z.z_max_m, {-100, 1000});
  v.list(Key("corners", "of the outline, in order; it must not cross itself").on_one_line(),
         z.corners, kMostCorners);
  if (YamlReader* y = v.reading(); y != nullptr) check(*y, z);
}

void keys(KeyVisitor& v, std::vector<ZoneConfig>& zones) {
  v.list({"zones", "no-go and slow-down zones"}, zones, kMostZones,
         [](YamlReader& y, const ZoneConfig& earlier, const ZoneConfig& zone) {
           if (earlier.id == zone.id) y.problem("id", "is that of another zone too");
         });
}

}  // namespace crane
