#include "config/site_config.hpp"

#include <arpa/inet.h>

#include <charconv>
#include <cmath>
#include <sstream>

#include "config/yaml_reader.hpp"
#include "config/yaml_text.hpp"
#include "geometry/simple_polygon.hpp"

namespace crane {
namespace {

/// As DdsConfig::Network counts.
const std::vector<std::string> kNetworks = {"local", "container", "plant"};

/// "host:port"; the host may be a name.
bool has_port(const std::string& text) {
  const auto colon = text.rfind(':');
  int port = 0;
  if (colon == std::string::npos || colon == 0) return false;
  const char* end = text.data() + text.size();
  const auto [stop, failed] = std::from_chars(text.data() + colon + 1, end, port);
  return failed == std::errc() && stop == end && port >= 1 && port <= 65'535;
}

void read_dds(YamlReader y, DdsConfig& c) {
  using Network = DdsConfig::Network;
  int network = 0;
  y.integer("domain", c.domain, 0, 232);
  std::string called;
  y.text("network", called);
  if (called == "wan")
    y.problem("network",
              "'wan' is gone: Fast DDS's TCP ends by 18 bytes of anybody. Use network: plant with "
              "peers, through a tunnel: deploy/network/README.md shows one");
  else
    y.choice("network", kNetworks, network);
  if (y.has("tcp_port")) y.problem("tcp_port", "is gone, as network: wan is");
  c.network = static_cast<Network>(network);
  if (c.network != Network::kLocal) c.interfaces.clear();
  c.shared_memory = c.network == Network::kLocal;
  y.flag("shared_memory", c.shared_memory);
  const bool named = y.has("interfaces");
  y.texts("interfaces", c.interfaces);
  for (const std::string& address : c.interfaces)
    if (in_addr ignored{}; inet_pton(AF_INET, address.c_str(), &ignored) != 1)
      y.problem("interfaces", "'" + address +
                                  "' is no IPv4 address of this host, such as 127.0.0.1: names, "
                                  "networks (/8) and IPv6 are not known to Fast DDS");
  y.texts("servers", c.servers);
  y.texts("peers", c.peers);
  y.text("security", c.security);
  y.text("identity", c.identity);
  y.integer("shm_segment_mib", c.shm_segment_mib, 16, 1024);
  y.integer("udp_buffer_kib", c.udp_buffer_kib, 64, 65'536);
  y.text("profile_file", c.profile_file);
  y.text("profile_name", c.profile_name);
  if (!c.profile_file.empty() && c.profile_name.empty())
    y.problem("profile_name", "must name a participant profile of profile_file");
  if (c.network == Network::kPlant) {
    if (!named) y.problem("interfaces", "must list this host's addresses to use; [] = all");
    if (c.servers.empty() && c.peers.empty())
      y.problem("servers", "or peers must be given: a plant's network has no multicast");
  }
  if (!c.servers.empty() && !c.security.empty())
    y.problem("servers", "do not go with security: Fast DDS 2.9 ends by an assertion; give peers");
  if (!c.servers.empty() && c.network != Network::kPlant)
    y.problem("servers", "are for network: plant");
  if (c.servers.size() > 4) y.problem("servers", "are more than 4");
  for (const std::string& server : c.servers)
    if (!has_port(server)) y.problem("servers", "'" + server + "' must be host:port");
}

void read_http(YamlReader y, HttpConfig& c) {
  y.text("address", c.address);
  y.integer("port", c.port, 0, 65'500);
  y.texts("hosts", c.hosts);
}

/// As StereoConfig::Matcher counts.
const std::vector<std::string> kMatchers = {"sgm", "bm", "sgbm"};

void read_stereo(YamlReader y, StereoConfig& c) {
  int preset = 0;
  int matcher = 0;
  y.choice("preset", {"default", "paper"}, preset);
  c.paper = preset == 1;
  y.choice("matcher", kMatchers, matcher);
  c.matcher = static_cast<StereoConfig::Matcher>(matcher);
  y.integer("block_px", c.block_px, 5, 21);
  if (c.block_px % 2 == 0) y.problem("block_px", "must be odd");
  y.integer("speckle_window_px", c.speckle_window_px, 0, 10'000);
  y.integer("uniqueness_percent", c.uniqueness_percent, 0, 50);
  y.integer("left_right_px", c.left_right_px, -1, 16);
  y.number("nearest_m", c.nearest_m, 0, 200);
  y.number("farthest_m", c.farthest_m, 0, 200);
  if (c.nearest_m > 0 && c.farthest_m > 0 && c.nearest_m >= c.farthest_m)
    y.problem("nearest_m", "must be less than farthest_m");
  y.number("sigma_disparity_px", c.sigma_disparity_px, 0.01, 10);
}

void read_mapper(YamlReader y, MapperConfig& c) {
  int method = 0;
  y.choice("method", {"default", "paper"}, method);
  c.method = static_cast<MapperConfig::Method>(method);
  double voxel = c.voxel_m;
  y.number("voxel_m", voxel, 0, 2);
  if (voxel != 0 && voxel < 0.005)
    y.problem("voxel_m", "must be 0 (automatic) or at least 0.005");
  else
    c.voxel_m = voxel;
  y.number("z_min_m", c.z_min_m, -20, 20);
  y.number("z_max_m", c.z_max_m, 0, 100);
  y.integer("max_position_gap_ms", c.max_position_gap_ms, 1, 60'000);
  y.integer("position_wait_ms", c.position_wait_ms, 0, 60'000);
  y.integer("cart_latency_ms", c.cart_latency_ms, -1000, 1000);
  y.integer("trolley_latency_ms", c.trolley_latency_ms, -1000, 1000);
  y.number("rangefinder_min_m", c.rangefinder_min_m, -1000, 1000);
  y.number("rangefinder_max_m", c.rangefinder_max_m, -1000, 1000);
  if (c.rangefinder_min_m >= c.rangefinder_max_m)
    y.problem("rangefinder_min_m", "must be less than rangefinder_max_m");
  y.number("rangefinder_noise_m", c.rangefinder_noise_m, 0.001, 1);
  y.number("largest_speed_mps", c.largest_speed_mps, 0.05, 100);
  y.integer("cart_direction", c.cart_direction, -1, 1);
  y.integer("trolley_direction", c.trolley_direction, -1, 1);
  if (c.cart_direction == 0) y.problem("cart_direction", "must be 1 or -1");
  if (c.trolley_direction == 0) y.problem("trolley_direction", "must be 1 or -1");
  y.number("cart_offset_m", c.cart_offset_m, -10'000, 10'000);
  y.number("trolley_offset_m", c.trolley_offset_m, -10'000, 10'000);
  y.number("rail_y_m", c.rail_y_m, -10'000, 10'000);
  y.number("rail_span_m", c.rail_span_m, -200, 200);
  y.integer("cart_second_direction", c.cart_second_direction, -1, 1);
  if (c.cart_second_direction == 0) y.problem("cart_second_direction", "must be 1 or -1");
  y.integer("cart_second_latency_ms", c.cart_second_latency_ms, -1000, 1000);
  y.number("cart_second_offset_m", c.cart_second_offset_m, -10'000, 10'000);
  y.number("largest_skew_deg", c.largest_skew_deg, 0.05, 20);
  if (c.rail_span_m != 0 && std::abs(c.rail_span_m) < 0.5)
    y.problem("rail_span_m", "must be 0 (one rangefinder), or at least 0.5 to either side");
  y.number("publish_hz", c.publish_hz, 0.1, 20);
  y.number("octree_hz", c.octree_hz, 0.01, 5);
  y.integer("stale_ms", c.stale_ms, 100, 600'000);
  y.number("forget_s", c.forget_s, 0, 1e7);
  if (c.forget_s > 0 && c.forget_s < 1) y.problem("forget_s", "must be 0 (never) or at least 1");
  y.integer("max_memory_mib", c.max_memory_mib, 64, 1'000'000);
  y.integer("outlier_neighbours", c.outlier_neighbours, 2, 1000);
  y.number("outlier_std", c.outlier_std, 0.01, 100);
  y.number("leaf_m", c.leaf_m, 0.001, 1);
  y.flag("outliers_first", c.outliers_first);
}

void read_hoist(YamlReader y, HoistConfig& c) {
  y.flag("enabled", c.enabled);
  y.number("offset_x_m", c.offset_x_m, -100, 100);
  y.number("offset_y_m", c.offset_y_m, -100, 100);
  y.number("rope_top_m", c.rope_top_m, 0, 200);
  y.number("rope_radius_m", c.rope_radius_m, 0, 5);
  y.number("hook_x_m", c.hook_x_m, 0.01, 10);
  y.number("hook_y_m", c.hook_y_m, 0.01, 10);
  y.number("hook_z_m", c.hook_z_m, 0.01, 10);
  y.number("margin_m", c.margin_m, 0, 5);
  y.number("sway_m", c.sway_m, 0, 10);
  y.number("largest_load_m", c.largest_load_m, 0, 50);
  y.number("accuracy_m", c.accuracy_m, 0, 2);
  y.integer("max_gap_ms", c.max_gap_ms, 50, 10'000);
}

struct WatchdogKey {
  const char* name;
  double WatchdogConfig::*value;
  double least, most;
};
/// Each pair in the order drifting, wrong.
constexpr WatchdogKey kWatchdogKeys[] = {
    {"height_drifting_percent", &WatchdogConfig::height_drifting_percent, 0.05, 100},
    {"height_wrong_percent", &WatchdogConfig::height_wrong_percent, 0.05, 100},
    {"tilt_drifting_deg", &WatchdogConfig::tilt_drifting_deg, 0.01, 90},
    {"tilt_wrong_deg", &WatchdogConfig::tilt_wrong_deg, 0.01, 90},
    {"roll_drifting_deg", &WatchdogConfig::roll_drifting_deg, 0.005, 90},
    {"roll_wrong_deg", &WatchdogConfig::roll_wrong_deg, 0.005, 90},
    {"rows_drifting_px", &WatchdogConfig::rows_drifting_px, 0.05, 100},
    {"rows_wrong_px", &WatchdogConfig::rows_wrong_px, 0.05, 100},
    {"scale_drifting_percent", &WatchdogConfig::scale_drifting_percent, 0.05, 100},
    {"scale_wrong_percent", &WatchdogConfig::scale_wrong_percent, 0.05, 100},
    {"turn_drifting_deg", &WatchdogConfig::turn_drifting_deg, 0.01, 90},
    {"turn_wrong_deg", &WatchdogConfig::turn_wrong_deg, 0.01, 90},
    {"delay_drifting_ms", &WatchdogConfig::delay_drifting_ms, 1, 1000},
    {"delay_wrong_ms", &WatchdogConfig::delay_wrong_ms, 1, 1000},
};

void read_watchdog(YamlReader y, WatchdogConfig& c) {
  y.flag("enabled", c.enabled);
  for (std::size_t i = 0; i < std::size(kWatchdogKeys); ++i) {
    const WatchdogKey& key = kWatchdogKeys[i];
    y.number(key.name, c.*key.value, key.least, key.most);
    if (i % 2 == 1 && c.*key.value < c.*kWatchdogKeys[i - 1].value)
      y.problem(key.name, std::string("must not be less than ") + kWatchdogKeys[i - 1].name);
  }
  y.number("jump_m", c.jump_m, 0.005, 10);
}

std::string outline_flaw(const ZoneConfig& z) {
  std::vector<Corner> outline;
  for (const ZoneConfig::Corner& c : z.corners) outline.push_back({c.x_m, c.y_m});
  return polygon_flaw(outline);
}

std::vector<ZoneConfig> read_zones(YamlReader& file) {
  std::vector<ZoneConfig> zones;
  for (YamlReader& y : file.items("zones")) {
    ZoneConfig z;
    int kind = 0;
    y.integer("id", z.id, 1, 1'000'000, true);
    y.text("name", z.name);
    y.choice("kind", {"no-go", "slow-down"}, kind);
    z.slow_down = kind == 1;
    y.flag("active", z.active);
    y.flag("switchable", z.switchable);
    y.number("z_min_m", z.z_min_m, -100, 1000);
    y.number("z_max_m", z.z_max_m, -100, 1000);
    for (YamlReader& corner : y.items("corners")) {
      ZoneConfig::Corner c;
      corner.number("x", c.x_m, -9e4, 9e4, true);
      corner.number("y", c.y_m, -9e4, 9e4, true);
      z.corners.push_back(c);
    }
    if (z.corners.size() < 3 || z.corners.size() > 32)
      y.problem("corners", "must be 3 to 32 of {x: .., y: ..}");
    else if (std::string flaw = outline_flaw(z); !flaw.empty())
      y.problem("corners", "of zone " + std::to_string(z.id) + ": the outline " + flaw);
    if (z.z_min_m >= z.z_max_m) y.problem("z_min_m", "must be less than z_max_m");
    if (z.name.size() > 63) y.problem("name", "has more than 63 characters");
    for (const ZoneConfig& other : zones)
      if (other.id == z.id) y.problem("id", "is that of another zone too");
    zones.push_back(z);
  }
  if (zones.size() > 64) file.problem("zones", "are more than 64");
  return zones;
}

Result<SiteConfig> read(Result<YamlReader> file) {
  if (!file) return file.error();
  SiteConfig config;
  file->integer("crane", config.crane, 1, 1'000'000);
  read_dds(file->section("dds"), config.dds);
  read_http(file->section("http"), config.http);
  read_camera(file->section("camera"), config.camera);
  read_stereo(file->section("stereo"), config.stereo);
  read_mapper(file->section("mapper"), config.mapper);
  read_hoist(file->section("hoist"), config.hoist);
  config.rangefinders = read_rangefinders(*file);
  read_watchdog(file->section("watchdog"), config.watchdog);
  config.zones = read_zones(*file);
  if (auto done = file->finish(); !done) return done.error();
  return config;
}

}  // namespace

const std::string& network_name(DdsConfig::Network network) {
  return kNetworks[static_cast<std::size_t>(network)];
}

Result<SiteConfig> read_site_config(const std::string& path) {
  return read(YamlReader::from_file(path));
}

Result<SiteConfig> parse_site_config(const std::string& text, const std::string& name) {
  return read(YamlReader::from_text(text, name));
}

std::string to_yaml(const SiteConfig& c) {
  std::ostringstream s;
  const auto list = [](const std::vector<std::string>& items) {
    std::string out = "[";
    for (std::size_t i = 0; i < items.size(); ++i)
      out += (i > 0 ? ", " : "") + yaml_quoted(items[i]);
    return out + "]";
  };
  s << "crane: " << c.crane << "\n"
    << "dds:\n"
    << "  domain: " << c.dds.domain << "\n"
    << "  network: " << network_name(c.dds.network) << "\n"
    << "  interfaces: " << list(c.dds.interfaces) << "\n"
    << "  servers: " << list(c.dds.servers) << "\n"
    << "  peers: " << list(c.dds.peers) << "\n"
    << "  security: " << yaml_quoted(c.dds.security) << "\n"
    << "  identity: " << yaml_quoted(c.dds.identity) << "\n"
    << "  shared_memory: " << (c.dds.shared_memory ? "true" : "false") << "\n"
    << "  shm_segment_mib: " << c.dds.shm_segment_mib << "\n"
    << "  udp_buffer_kib: " << c.dds.udp_buffer_kib << "\n";
  if (!c.dds.profile_file.empty())
    s << "  profile_file: " << yaml_quoted(c.dds.profile_file) << "\n"
      << "  profile_name: " << yaml_quoted(c.dds.profile_name) << "\n";
  s << "http:\n"
    << "  address: " << yaml_quoted(c.http.address) << "\n"
    << "  port: " << c.http.port << "\n"
    << "  hosts: " << list(c.http.hosts) << "\n"
    << to_yaml(c.camera) << "stereo:\n"
    << "  preset: " << (c.stereo.paper ? "paper" : "default") << "\n"
    << "  matcher: " << kMatchers[static_cast<std::size_t>(c.stereo.matcher)] << "\n"
    << "  block_px: " << c.stereo.block_px << "\n"
    << "  speckle_window_px: " << c.stereo.speckle_window_px << "\n"
    << "  uniqueness_percent: " << c.stereo.uniqueness_percent << "\n"
    << "  left_right_px: " << c.stereo.left_right_px << "\n"
    << "  nearest_m: " << yaml_exact(c.stereo.nearest_m) << "\n"
    << "  farthest_m: " << yaml_exact(c.stereo.farthest_m) << "\n"
    << "  sigma_disparity_px: " << yaml_exact(c.stereo.sigma_disparity_px) << "\n"
    << "mapper:\n"
    << "  method: " << (c.mapper.method == MapperConfig::Method::kPaper ? "paper" : "default")
    << "\n"
    << "  voxel_m: " << yaml_exact(c.mapper.voxel_m) << "\n"
    << "  z_min_m: " << yaml_exact(c.mapper.z_min_m) << "\n"
    << "  z_max_m: " << yaml_exact(c.mapper.z_max_m) << "\n"
    << "  max_position_gap_ms: " << c.mapper.max_position_gap_ms << "\n"
    << "  position_wait_ms: " << c.mapper.position_wait_ms << "\n"
    << "  cart_latency_ms: " << c.mapper.cart_latency_ms << "\n"
    << "  trolley_latency_ms: " << c.mapper.trolley_latency_ms << "\n"
    << "  rangefinder_min_m: " << yaml_exact(c.mapper.rangefinder_min_m) << "\n"
    << "  rangefinder_max_m: " << yaml_exact(c.mapper.rangefinder_max_m) << "\n"
    << "  rangefinder_noise_m: " << yaml_exact(c.mapper.rangefinder_noise_m) << "\n"
    << "  largest_speed_mps: " << yaml_exact(c.mapper.largest_speed_mps) << "\n"
    << "  cart_direction: " << c.mapper.cart_direction << "\n"
    << "  trolley_direction: " << c.mapper.trolley_direction << "\n"
    << "  cart_offset_m: " << yaml_exact(c.mapper.cart_offset_m) << "\n"
    << "  trolley_offset_m: " << yaml_exact(c.mapper.trolley_offset_m) << "\n"
    << "  rail_y_m: " << yaml_exact(c.mapper.rail_y_m) << "\n"
    << "  rail_span_m: " << yaml_exact(c.mapper.rail_span_m) << "\n"
    << "  cart_second_direction: " << c.mapper.cart_second_direction << "\n"
    << "  cart_second_latency_ms: " << c.mapper.cart_second_latency_ms << "\n"
    << "  cart_second_offset_m: " << yaml_exact(c.mapper.cart_second_offset_m) << "\n"
    << "  largest_skew_deg: " << yaml_exact(c.mapper.largest_skew_deg) << "\n"
    << "  publish_hz: " << yaml_exact(c.mapper.publish_hz) << "\n"
    << "  octree_hz: " << yaml_exact(c.mapper.octree_hz) << "\n"
    << "  stale_ms: " << c.mapper.stale_ms << "\n"
    << "  forget_s: " << yaml_exact(c.mapper.forget_s) << "\n"
    << "  max_memory_mib: " << c.mapper.max_memory_mib << "\n"
    << "  outlier_neighbours: " << c.mapper.outlier_neighbours << "\n"
    << "  outlier_std: " << yaml_exact(c.mapper.outlier_std) << "\n"
    << "  leaf_m: " << yaml_exact(c.mapper.leaf_m) << "\n"
    << "  outliers_first: " << (c.mapper.outliers_first ? "true" : "false") << "\n"
    << "hoist:\n"
    << "  enabled: " << (c.hoist.enabled ? "true" : "false") << "\n"
    << "  offset_x_m: " << yaml_exact(c.hoist.offset_x_m) << "\n"
    << "  offset_y_m: " << yaml_exact(c.hoist.offset_y_m) << "\n"
    << "  rope_top_m: " << yaml_exact(c.hoist.rope_top_m) << "\n"
    << "  rope_radius_m: " << yaml_exact(c.hoist.rope_radius_m) << "\n"
    << "  hook_x_m: " << yaml_exact(c.hoist.hook_x_m) << "\n"
    << "  hook_y_m: " << yaml_exact(c.hoist.hook_y_m) << "\n"
    << "  hook_z_m: " << yaml_exact(c.hoist.hook_z_m) << "\n"
    << "  margin_m: " << yaml_exact(c.hoist.margin_m) << "\n"
    << "  sway_m: " << yaml_exact(c.hoist.sway_m) << "\n"
    << "  largest_load_m: " << yaml_exact(c.hoist.largest_load_m) << "\n"
    << "  accuracy_m: " << yaml_exact(c.hoist.accuracy_m) << "\n"
    << "  max_gap_ms: " << c.hoist.max_gap_ms << "\n";
  s << to_yaml(c.rangefinders);
  s << "watchdog:\n  enabled: " << (c.watchdog.enabled ? "true" : "false") << "\n";
  for (const WatchdogKey& key : kWatchdogKeys)
    s << "  " << key.name << ": " << yaml_exact(c.watchdog.*key.value) << "\n";
  s << "  jump_m: " << yaml_exact(c.watchdog.jump_m) << "\n";
  if (!c.zones.empty()) s << "zones:\n";
  for (const ZoneConfig& z : c.zones) {
    s << "  - {id: " << z.id << ", name: " << yaml_quoted(z.name)
      << ", kind: " << (z.slow_down ? "slow-down" : "no-go")
      << ", active: " << (z.active ? "true" : "false")
      << ", switchable: " << (z.switchable ? "true" : "false")
      << ", z_min_m: " << yaml_exact(z.z_min_m) << ", z_max_m: " << yaml_exact(z.z_max_m)
      << ", corners: [";
    for (std::size_t i = 0; i < z.corners.size(); ++i)
      s << (i > 0 ? ", " : "") << "{x: " << yaml_exact(z.corners[i].x_m)
        << ", y: " << yaml_exact(z.corners[i].y_m) << "}";
    s << "]}\n";
  }
  return s.str();
}

}  // namespace crane
