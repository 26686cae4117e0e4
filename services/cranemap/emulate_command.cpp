#include <arpa/inet.h>
#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <random>
#include <set>

#include "base/clock.hpp"
#include "base/log.hpp"
#include "commands.hpp"
#include "config/site_config.hpp"
#include "emulated_trajectory.hpp"
#include "live_scene.hpp"
#include "sensors/distance/emulators.hpp"
#include "service/run_service.hpp"

namespace crane {
namespace {

namespace fs = std::filesystem;

/// What goes wrong, for how long, how often: a fault lasts for `lasts_s` of every `every_s`.
const std::set<std::string> kFaults = {"garbage", "truncate", "flip",   "stall",
                                       "unplug",  "zero",     "broken", "dirty"};

struct Options {
  std::string device, port, recording, scene, axis = "cart", config;
  EmulatedTrajectory::ToAndFro way;
  double scene_speed_mps = 0, hz = 20, for_s = 0;
  double every_s = 10, lasts_s = 2;
  std::vector<std::string> faults;
  double unit_m = 0;
  TimeNs start_at = 0;
};

/// Where the axis is. Error: of the recording or scene.
Result<EmulatedTrajectory> trajectory_of(const Options& o) {
  const bool cart = o.axis == "cart";
  if (!o.recording.empty()) return EmulatedTrajectory::of_recording(o.recording, cart);
  if (o.scene.empty()) return EmulatedTrajectory(o.way);
  auto scene = read_live_scene(o.scene, {o.scene_speed_mps, 0, true});
  if (!scene) return scene.error();
  return EmulatedTrajectory::of_scene(std::move(*scene), cart);
}

/// Where the device can be reached: a pseudo-terminal under a name, a TCP port that is listened on,
/// or datagrams sent to a port.
class Outlet {
 public:
  explicit Outlet(std::string port) : port_(std::move(port)) {}
  ~Outlet() { unplug(); }
  Outlet(const Outlet&) = delete;
  Outlet& operator=(const Outlet&) = delete;

  [[nodiscard]] bool plugged() const { return fd_ >= 0 || listener_ >= 0; }

  Result<void> plug() {
    if (plugged()) return {};
    if (port_.starts_with("udp://") || port_.starts_with("tcp://")) return plug_socket();
    fd_ = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (fd_ < 0 || grantpt(fd_) != 0 || unlockpt(fd_) != 0) return refuse("no pseudo-terminal");
    std::array<char, 128> name{};
    if (ptsname_r(fd_, name.data(), name.size()) != 0) return refuse("no pseudo-terminal");
    // Raw from the start: nothing is echoed before the other side has opened it.
    if (const int other = open(name.data(), O_RDWR | O_NOCTTY | O_CLOEXEC); other >= 0) {
      termios raw{};
      tcgetattr(other, &raw);
      cfmakeraw(&raw);
      tcsetattr(other, TCSANOW, &raw);
      close(other);
    }
    std::error_code ignored;
    if (fs::is_symlink(port_, ignored)) fs::remove(port_, ignored);
    std::error_code failed;
    fs::create_symlink(name.data(), port_, failed);
    if (failed) return refuse(failed.message());
    linked_ = true;
    return {};
  }

  void unplug() {
    for (int* fd : {&fd_, &listener_}) {
      if (*fd >= 0) close(*fd);
      *fd = -1;
    }
    std::error_code ignored;
    if (linked_) fs::remove(port_, ignored);
    linked_ = false;
  }

  std::string read() {
    accept_one();
    std::array<char, 256> bytes{};
    if (fd_ < 0) return {};
    const ssize_t n = ::read(fd_, bytes.data(), bytes.size());
    if (n == 0 && listener_ >= 0) drop();
    return n > 0 ? std::string(bytes.data(), std::size_t(n)) : "";
  }
  /// What nobody takes is lost, as on a line.
  void write(const std::string& bytes) {
    if (fd_ < 0 || bytes.empty()) return;
    const bool socket = listener_ >= 0 || port_.starts_with("udp://");
    const ssize_t n = socket ? send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL)
                             : ::write(fd_, bytes.data(), bytes.size());
    if (n < 0 && (errno == EPIPE || errno == ECONNRESET) && listener_ >= 0) drop();
  }

 private:
  Result<void> refuse(const std::string& why) {
    unplug();
    return Error{ErrorCode::kResource, port_, "cannot be emulated: " + why,
                 "choose another --port"};
  }
  Result<void> plug_socket() {
    const bool udp = port_.starts_with("udp://");
    const auto colon = port_.rfind(':');
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_port = htons(static_cast<std::uint16_t>(std::atoi(port_.c_str() + colon + 1)));
    if (inet_pton(AF_INET, port_.substr(6, colon - 6).c_str(), &at.sin_addr) != 1)
      return refuse("its host must be an IPv4 address");
    const int fd =
        socket(AF_INET, (udp ? SOCK_DGRAM : SOCK_STREAM) | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    (udp ? fd_ : listener_) = fd;
    const int on = 1;
    setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    const auto* address = reinterpret_cast<const sockaddr*>(&at);
    if (udp ? connect(fd, address, sizeof at) != 0
            : bind(fd, address, sizeof at) != 0 || listen(fd, 1) != 0)
      return refuse(std::strerror(errno));
    return {};
  }
  void accept_one() {
    if (listener_ < 0 || fd_ >= 0) return;
    fd_ = accept4(listener_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
  }
  void drop() {
    close(fd_);
    fd_ = -1;
  }
  std::string port_;
  int fd_ = -1, listener_ = -1;
  bool linked_ = false;
};

/// The device of a configuration that names it, or of the command line.
Result<RangefinderConfig> configured(const Options& o) {
  if (!o.config.empty()) {
    const auto site = read_site_config(o.config);
    if (!site) return site.error();
    for (const RangefinderConfig& c : site->rangefinders)
      if (axis_name(c.axis) == o.axis) return c;
    return Error{ErrorCode::kConfiguration, o.config, "names no rangefinder of axis " + o.axis, ""};
  }
  const std::string text = "rangefinders:\n  - {axis: " + o.axis + ", device: " + o.device +
                           ", port: \"" + o.port + "\"" +
                           (o.unit_m > 0 ? ", unit_m: " + std::to_string(o.unit_m) : "") + "}\n";
  const auto site = parse_site_config(text, "--device");
  if (!site) return site.error();
  return site->rangefinders.front();
}

int emulate(const Options& o) {
  const auto config = configured(o);
  const auto trajectory = trajectory_of(o);
  const auto fail = [](const Error& error) {
    log_error(error.text());
    return exit_code(error);
  };
  if (!config) return fail(config.error());
  if (!trajectory) return fail(trajectory.error());
  const auto device = make_distance_emulator(*config);
  if (device == nullptr)
    return fail(
        {ErrorCode::kConfiguration, "modbus", "is not emulated here", "any Modbus server will do"});
  const std::string port = o.port.empty() ? config->port : o.port;
  Outlet outlet(port);
  if (auto plugged = outlet.plug(); !plugged) return fail(plugged.error());
  log_info("emulates " + device_name(config->device) + " at " + port);
  std::mt19937 random(1);
  const auto has = [&o](const char* fault) {
    return std::find(o.faults.begin(), o.faults.end(), fault) != o.faults.end();
  };
  const auto spoiled = [&](std::string bytes) {
    if (bytes.empty()) return bytes;
    const auto any = [&random](std::size_t n) { return random() % n; };
    if (has("garbage"))
      for (char& c : bytes) c = static_cast<char>(random() & 0xFFU);
    if (has("truncate")) bytes.resize(any(bytes.size()));
    if (has("flip") && !bytes.empty()) {
      char& c = bytes[any(bytes.size())];
      c = static_cast<char>(c ^ (1U << any(8)));
    }
    return bytes;
  };
  const Stopwatch watch;
  const SystemClock wall;
  const TimeNs start_at = o.start_at > 0 ? o.start_at : wall.now();
  for (double next_ms = 0; !stop_requested();) {
    const double seconds = watch.ms() * 1e-3;
    if (o.for_s > 0 && seconds > o.for_s) break;
    // A fault begins at the end of each period: the device works first.
    const bool faulty = !o.faults.empty() && std::fmod(seconds, o.every_s) >= o.every_s - o.lasts_s;
    if (has("unplug") && faulty) {
      outlet.unplug();
    } else if (auto plugged = outlet.plug(); !plugged) {
      return fail(plugged.error());
    }
    EmulatedMeasurement now;
    now.distance_m = trajectory->at(double(wall.now() - start_at) * 1e-9);
    now.no_target = faulty && has("zero");
    now.broken = faulty && has("broken");
    now.dirty = faulty && has("dirty");
    std::string answer = device->hear(outlet.read(), now);
    if (watch.ms() >= next_ms) {
      answer += device->stream(now);
      next_ms += 1000 / o.hz;
    }
    if (!(faulty && has("stall"))) outlet.write(faulty ? spoiled(answer) : answer);
    poll(nullptr, 0, 2);
  }
  return kExitOk;
}

}  // namespace

Command add_emulate_command(CLI::App& app) {
  auto options = std::make_shared<Options>();
  Options& o = *options;
  CLI::App* command = app.add_subcommand(
      "emulate",
      "Stands in for a rangefinder: on a pseudo-terminal or socket it says what the device would,\n"
      "with faults if wanted. For trying a configuration without hardware.\n"
      "Example: cranemap emulate sick-dl100 --port /tmp/cart --from 2 --to 20 --speed 0.5\n"
      "         cranemap emulate --config site.yaml --axis trolley --fault unplug --every 30");
  command->add_option("DEVICE", o.device, "As 'device' in the configuration: docs/sensors.md");
  command->add_option("--config", o.config, "Site configuration whose rangefinder it is");
  command->add_option("--axis", o.axis, "Of the configuration, or of the recording")
      ->check(CLI::IsMember({"cart", "trolley"}))
      ->capture_default_str();
  command->add_option("--port", o.port,
                      "Name of the pseudo-terminal to make, tcp://address:port to listen on, or "
                      "udp://address:port to send to; default: the configuration's");
  command->add_option("--unit", o.unit_m, "Length of one count [m], where the device has none");
  command->add_option("--from", o.way.from_m, "Nearest distance [m]")->capture_default_str();
  command->add_option("--to", o.way.to_m, "Farthest distance [m]")->capture_default_str();
  command->add_option("--speed", o.way.speed_mps, "To and fro [m/s]")->capture_default_str();
  auto* recording =
      command->add_option("--recording", o.recording, "Distances of a recording instead");
  command->add_option("--scene", o.scene, "Distances of a scene's crane, which drives, instead")
      ->excludes(recording);
  command
      ->add_option("--scene-speed", o.scene_speed_mps,
                   "Of the scene's crane [m/s]; 0 = the scene's")
      ->check(CLI::Range(0.0, 10.0));
  command->add_option(
      "--start-at", o.start_at,
      "Wall time [ns] of the first distance; a camera that plays the same recording "
      "with --loop and the same --start-at is on the same crane; 0 = now");
  command->add_option("--rate", o.hz, "Telegrams a second of a stream")
      ->check(CLI::Range(0.1, 1000.0))
      ->capture_default_str();
  command->add_option("--for", o.for_s, "End after so many seconds; 0 = never")
      ->capture_default_str();
  command
      ->add_option("--fault", o.faults,
                   "What goes wrong; repeatable: garbage, truncate, flip (a bit), stall, unplug, "
                   "zero (no target), broken, dirty")
      ->check(CLI::IsMember(kFaults));
  command->add_option("--every", o.every_s, "A fault comes every so many seconds")
      ->check(CLI::Range(0.1, 86'400.0))
      ->capture_default_str();
  command->add_option("--lasts", o.lasts_s, "and lasts for so many")
      ->check(CLI::Range(0.0, 86'400.0))
      ->capture_default_str();
  return [options]() -> int {
    if (options->device.empty() == options->config.empty()) {
      log_error("emulate: give either DEVICE and --port, or --config");
      return kExitConfiguration;
    }
    if (options->config.empty() && options->port.empty()) {
      log_error("--port: is needed -> for example --port /tmp/cart");
      return kExitConfiguration;
    }
    return emulate(*options);
  };
}

}  // namespace crane
