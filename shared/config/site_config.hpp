#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "config/camera_config.hpp"
#include "config/rangefinder_config.hpp"

namespace crane {

// One file configures all services of one crane; each service reads its part.
// Defaults work for the demo; ranges are checked when the file is read.

struct DdsConfig {
  /// local: one host, zero-copy. container: UDP, multicast discovery, no shared memory.
  /// plant: UDP, discovery by servers or peers only; over routers as well, to far hosts in a
  /// tunnel.
  enum class Network { kLocal, kContainer, kPlant };
  int domain = 0;  ///< 0..232
  Network network = Network::kLocal;
  /// IPv4; empty = all. Default: loopback for local, all for container; plant must say.
  std::vector<std::string> interfaces = {"127.0.0.1"};
  std::vector<std::string> servers;  ///< discovery servers "host:port", for plant; 1 to 4
  std::vector<std::string> peers;    ///< hosts to look for
  std::string security;              ///< folder of deploy/security/make; empty = off
  std::string identity;              ///< of that folder; empty = by the program's name
  bool shared_memory =
      true;                  ///< between processes of this host; default false for container, plant
  int shm_segment_mib = 64;  ///< 16..1024
  int udp_buffer_kib = 4096;               ///< 64..65536
  std::string profile_file, profile_name;  ///< Fast DDS XML instead of network and what it uses
};

/// Where a service answers /metrics and /healthz: at `port` plus its number (1 camera,
/// 2 rangefinder, 3 stereo, 4 mapper, 5 clearance, 6 ros2-mirror, 8 discovery).
struct HttpConfig {
  std::string address = "127.0.0.1";
  int port = 9460;  ///< 0 = nowhere
  /// Names of this host by which it is asked, beside localhost, its addresses and its own name.
  std::vector<std::string> hosts;
};

struct StereoConfig {
  enum class Matcher { kSgm, kBlock, kSgbm };
  Matcher matcher = Matcher::kSgm;  ///< matcher: sgm | bm | sgbm (the last two: OpenCV's)
  bool paper = false;               ///< preset: default | paper (eq. 10 disparities, full search)
  int block_px = 9;                 ///< odd, 5..21
  int speckle_window_px = 100;      ///< 0 = off
  int uniqueness_percent = 15;      ///< 0..50
  int left_right_px = 1;            ///< largest left-right disagreement; -1 = no check
  /// Search range as depth [m]; 0 = 0.52 and 1.15 times the camera's height above the floor.
  /// What stands nearer to the camera gets no match: it stays unknown, never free.
  double nearest_m = 0, farthest_m = 0;
  double sigma_disparity_px = 0.05;  ///< standard deviation of a match of confidence 255
};

struct MapperConfig {
  enum class Method { kDefault, kPaper };
  Method method = Method::kDefault;
  double voxel_m = 0;             ///< 0 = 0.1 D (eq. 9), D = height of the camera
  double z_min_m = -0.3;          ///< lowest mapped height
  double z_max_m = 0;             ///< highest; 0 = just below the camera
  int max_position_gap_ms = 200;  ///< between two readings of one rangefinder
  int position_wait_ms = 1000;    ///< for the reading after the exposure to arrive
  int cart_latency_ms = 0;        ///< of the rangefinder: subtracted from its time stamps
  int trolley_latency_ms = 0;
  /// Of a reading as measured; outside: refused. An interrupted beam reads 0, or full scale.
  double rangefinder_min_m = 0.05, rangefinder_max_m = 1000;
  double rangefinder_noise_m = 0.03;  ///< two readings of one place differ by less
  double largest_speed_mps = 3;       ///< of cart and trolley: what is faster is a jump
  /// Map coordinate = offset + direction * reading: -1 where the device stands at the far end.
  int cart_direction = 1, trolley_direction = 1;
  double cart_offset_m = 0, trolley_offset_m = 0;
  /// Two rangefinders of the cart, one a rail, tell how skew the bridge is: the first at map y
  /// rail_y_m, the second rail_span_m further (may be negative); 0 = there is one.
  double rail_y_m = 0, rail_span_m = 0;
  int cart_second_direction = 1, cart_second_latency_ms = 0;
  double cart_second_offset_m = 0;
  double largest_skew_deg = 2;  ///< by more no bridge turns: then one of both is wrong
  double publish_hz = 20;       ///< changed tiles
  double octree_hz = 1;         ///< whole octree, when changed
  int stale_ms = 2000;          ///< no cloud for longer: the map says so
  double forget_s = 3600;       ///< what is not seen again for so long is unknown; 0 = never
  int max_memory_mib = 4096;    ///< of the map
  // method: paper
  int outlier_neighbours = 50;  ///< 50 or 60 in the paper
  double outlier_std = 1.0;     ///< 1.0 or 0.8
  double leaf_m = 0.01;         ///< voxel grid filter
  bool outliers_first = false;  ///< filter order; grid first is the paper's speed
};

/// Hook, rope and load, which topic hoist_state places: cut out of what the camera adds.
struct HoistConfig {
  bool enabled = false;  ///< true: without hoist_state nothing below the trolley is mapped
  double offset_x_m = 0, offset_y_m = 0;  ///< hook at rest minus (cart, trolley), map
  double rope_top_m = 0;                  ///< upper end of the rope; 0 = the camera's height
  double rope_radius_m = 0.1;             ///< of all falls together
  double hook_x_m = 0.4, hook_y_m = 0.4, hook_z_m = 0.5;  ///< hook block
  double margin_m = 0.15;                                 ///< around everything
  double sway_m = 0.1;                                    ///< that the controller does not know of
  double largest_load_m = 3;  ///< side of the largest load: cut out while nothing is known
  double accuracy_m = 0.05;   ///< of heights and sizes: so much less is proven free
  int max_gap_ms = 300;       ///< no hoist_state for longer: lost
};

/// Does what the camera sees agree with calibration and positions? From the first figure on it is
/// said (drifting); from the second on no frame is used and the map is not valid (wrong).
struct WatchdogConfig {
  bool enabled = true;
  /// Height of the floor, and depths: percent of the camera's height, and of themselves.
  double height_drifting_percent = 0.4, height_wrong_percent = 0.7;
  double tilt_drifting_deg = 0.15, tilt_wrong_deg = 0.3;           ///< of the camera's mount
  double roll_drifting_deg = 0.05, roll_wrong_deg = 0.1;           ///< of the right camera
  double rows_drifting_px = 0.5, rows_wrong_px = 1;                ///< right image lower or higher
  double scale_drifting_percent = 0.3, scale_wrong_percent = 0.6;  ///< of a rangefinder
  double turn_drifting_deg = 0.075, turn_wrong_deg = 0.14;  ///< of the image against the rails
  double delay_drifting_ms = 20, delay_wrong_ms = 35;       ///< rangefinder against camera
  double jump_m = 0.03;  ///< a frame so far beside its positions is not used; three: wrong
};

/// A no-go or slow-down zone, fixed or switchable by topic zone_command.
struct ZoneConfig {
  struct Corner {
    double x_m = 0, y_m = 0;
  };
  int id = 0;  ///< 1 ..
  std::string name;
  bool slow_down = false;  ///< kind: no-go | slow-down
  bool active = true, switchable = false;
  double z_min_m = -100, z_max_m = 1000;
  std::vector<Corner> corners;  ///< 3 .. 32
};

struct SiteConfig {
  int crane = 1;
  DdsConfig dds;
  HttpConfig http;
  CameraConfig camera;
  StereoConfig stereo;
  MapperConfig mapper;
  HoistConfig hoist;
  std::vector<RangefinderConfig> rangefinders;  ///< connected to this host; none: a recording plays
  WatchdogConfig watchdog;
  std::vector<ZoneConfig> zones;  ///< at most 64
};

/// As dds.network says it.
const std::string& network_name(DdsConfig::Network network);

/// Error: Configuration with every problem of the file, each with its line.
Result<SiteConfig> read_site_config(const std::string& path);
Result<SiteConfig> parse_site_config(const std::string& text, const std::string& name);

/// The effective configuration as YAML; read_site_config() accepts it.
std::string to_yaml(const SiteConfig& config);

}  // namespace crane
