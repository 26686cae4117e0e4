// SPDX-License-Identifier: Apache-2.0
#include <poll.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <random>
#include <set>

#include "base/clock.hpp"
#include "base/log.hpp"
#include "commands.hpp"
#include "config/site_config.hpp"
#include "emulate_outlet.hpp"
#include "emulated_trajectory.hpp"
#include "live_scene.hpp"
#include "sensors/distance/emulators.hpp"
#include "sensors/distance/modbus_emulator.hpp"
#include "service/run_service.hpp"

namespace crane {
namespace {

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

  [[nodiscard]] bool has(const char* fault) const {
    return std::find(faults.begin(), faults.end(), fault) != faults.end();
  }
  /// A fault begins at the end of each period: the device works first.
  [[nodiscard]] bool faulty(double seconds) const {
    return !faults.empty() && std::fmod(seconds, every_s) >= every_s - lasts_s;
  }
  [[nodiscard]] EmulatedMeasurement measure(double distance_m, double seconds) const {
    const bool now = faulty(seconds);
    return {distance_m, now && has("zero"), now && has("dirty"), now && has("broken")};
  }
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
                           (o.unit_m > 0 ? ", unit_m: " + std::to_string(o.unit_m) : "") +
                           (o.device == "modbus" ? ", modbus: {value_register: 0}" : "") + "}\n";
  const auto site = parse_site_config(text, "--device");
  if (!site) return site.error();
  return site->rangefinders.front();
}

/// A PLC with Modbus TCP. Of the faults those that its registers can have, unplug and stall.
int emulate_modbus(const Options& o, RangefinderConfig config, const std::string& port,
                   const EmulatedTrajectory& trajectory) {
  config.port = port;
  log_info("emulates modbus at " + port);
  const Stopwatch watch;
  const SystemClock wall;
  const TimeNs start_at = o.start_at > 0 ? o.start_at : wall.now();
  std::unique_ptr<ModbusEmulator> server;
  for (double next_ms = 0; !stop_requested();) {
    const double seconds = watch.ms() * 1e-3;
    if (o.for_s > 0 && seconds > o.for_s) break;
    const bool faulty = o.faulty(seconds);
    if (faulty && o.has("unplug")) server.reset();
    if (server == nullptr && !(faulty && o.has("unplug"))) {
      auto made = ModbusEmulator::listen(config);
      if (!made) {
        log_error(made.error().text());
        return exit_code(made.error());
      }
      server = std::move(*made);
    }
    if (server == nullptr || (faulty && o.has("stall"))) {
      poll(nullptr, 0, 2);
      continue;
    }
    if (watch.ms() >= next_ms) {
      server->measure(o.measure(trajectory.at(double(wall.now() - start_at) * 1e-9), seconds));
      next_ms = watch.ms() + 1000 / o.hz;
    }
    server->answer(std::chrono::milliseconds(2));
  }
  return kExitOk;
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
  const std::string port = o.port.empty() ? config->port : o.port;
  if (config->device == RangefinderConfig::Device::kModbus)
    return emulate_modbus(o, *config, port, *trajectory);
  const auto device = make_distance_emulator(*config);
  Outlet outlet(port);
  if (auto plugged = outlet.plug(); !plugged) return fail(plugged.error());
  log_info("emulates " + device_name(config->device) + " at " + port);
  std::mt19937 random(1);
  const auto has = [&o](const char* fault) { return o.has(fault); };
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
    const bool faulty = o.faulty(seconds);
    if (has("unplug") && faulty) {
      outlet.unplug();
    } else if (auto plugged = outlet.plug(); !plugged) {
      return fail(plugged.error());
    }
    const EmulatedMeasurement now =
        o.measure(trajectory->at(double(wall.now() - start_at) * 1e-9), seconds);
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
