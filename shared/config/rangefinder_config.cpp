// SPDX-License-Identifier: Apache-2.0
#include "config/rangefinder_config.hpp"

#include <algorithm>
#include <iterator>

#include "config/key.hpp"
#include "config/yaml_reader.hpp"

namespace crane {
namespace {

using Device = RangefinderConfig::Device;

// As the enums count.
const std::vector<std::string> kDevices = {"sick-dl100", "sick-dl50", "sick-dt1000", "dimetix",
                                           "benewake",   "leuze-bps", "text",        "telegram",
                                           "modbus",     "pf-wcs"};
const std::vector<std::string> kAxes = {"cart", "trolley"};
const std::vector<std::string> kNumbers = {"int16",  "uint16",  "int32",
                                           "uint32", "float32", "float64"};
const std::vector<std::string> kParities = {"none", "even", "odd"};
constexpr char kParityOf[] = {'N', 'E', 'O'};
constexpr std::size_t kMost = 4;  ///< two a rail

bool has_own_unit(Device device) {
  return device != Device::kSickDl50 && device != Device::kText && device != Device::kTelegram &&
         device != Device::kModbus && device != Device::kWcs;
}

void check_port(YamlReader& y, const RangefinderConfig& c) {
  const bool tcp = c.port.starts_with("tcp://");
  const bool udp = c.port.starts_with("udp://");
  if (c.port.empty()) return;  // said already
  if (!tcp && !udp && !c.port.starts_with("/"))
    y.problem("port", "must be a device such as /dev/ttyUSB0, tcp://host:port or udp://host:port");
  else if ((tcp || udp) && c.port.find(':', 6) == std::string::npos && c.device != Device::kModbus)
    y.problem("port", "has no port number: tcp://host:port");
  else if (c.device == Device::kModbus && !tcp)
    y.problem("port", "must be tcp://host:502 for device: modbus");
  else if (udp && c.device != Device::kTelegram)
    y.problem("port", "by udp:// only device: telegram is heard");
  else if (c.device == Device::kTelegram && !tcp && !udp)
    y.problem("port", "must be udp://host:port or tcp://host:port for device: telegram");
}

void check(YamlReader& y, const RangefinderConfig& c, bool device_known) {
  if (device_known && !has_own_unit(c.device) && c.unit_m == 0)
    y.problem("unit_m", "must be given for device: " + device_name(c.device) +
                            ": the length of one count, 0.001 for millimetres");
  if (c.min_m >= c.max_m) y.problem("min_m", "must be less than max_m");
  if (!c.question.empty() && c.device != Device::kText)
    y.problem("question", "is for device: text; the others know theirs");
  check_port(y, c);
}

void check_pair(YamlReader& y, const RangefinderConfig& earlier, const RangefinderConfig& c) {
  if (earlier.axis == c.axis) y.problem("axis", "has another rangefinder in this list");
  if (earlier.port != c.port) return;
  const bool shares =
      c.device == earlier.device && (c.device == Device::kModbus || c.device == Device::kTelegram);
  if (!shares) y.problem("port", "is that of another rangefinder too");
  if (c.device == Device::kTelegram && c.telegram.length != earlier.telegram.length)
    y.problem("telegram", "has another length than that of the same port");
}

}  // namespace

static void keys(KeyVisitor& v, PlcTelegramConfig& c) {
  v.integer(Key("length", "of a whole telegram").in("bytes").required(), c.length, {1, 512});
  v.integer(Key("value_offset", "where the distance begins").in("bytes").required(), c.value_offset,
            {0, 510});
  v.choice({"value_type", "of the distance"}, c.value_type, kNumbers);
  v.integer(
      Key("heartbeat_offset", "of a number that changes while the PLC lives; -1: none").in("bytes"),
      c.heartbeat_offset, {-1, 510});
  v.choice({"heartbeat_type", "of that number"}, c.heartbeat_type, kNumbers);
  v.flag({"little_endian", "low byte first"}, c.little_endian);
  YamlReader* y = v.reading();
  if (y == nullptr) return;
  const auto inside = [&](const char* key, int offset, PlcNumber type) {
    if (offset >= 0 && offset + static_cast<int>(plc_bytes(type)) > c.length)
      y->problem(key, "lies beyond the end of the telegram");
  };
  inside("value_offset", c.value_offset, c.value_type);
  inside("heartbeat_offset", c.heartbeat_offset, c.heartbeat_type);
}

static void keys(KeyVisitor& v, ModbusConfig& c) {
  v.integer({"unit", "number of the unit (slave)"}, c.unit, {0, 255});
  v.integer(Key("value_register", "of the distance, as the protocol counts, from 0").required(),
            c.value_register, {0, 65'535});
  v.choice({"value_type", "of the distance"}, c.type, kNumbers);
  v.choice({"registers", "which are read"}, c.input_registers, {"holding", "input"});
  v.flag({"low_word_first", "of numbers of two and four registers"}, c.low_word_first);
  v.flag({"swap_bytes", "within a register"}, c.swap_bytes);
  v.integer({"heartbeat_register", "of a number that changes while the PLC lives; -1: none"},
            c.heartbeat_register, {-1, 65'535});
}

static void keys(KeyVisitor& v, RangefinderConfig& c) {
  v.choice(Key("axis", "that it measures").required(), c.axis, kAxes);
  const bool known =
      v.choice(Key("device", "what it is: docs/sensors.md").required(), c.device, kDevices);
  v.text(Key("port",
             "/dev/ttyUSB0, tcp://host:port, or udp://host:port: datagrams of that host on our "
             "port")
             .required(),
         c.port);
  v.integer(Key("baud", "of a serial port").in("Bd").by_default("0: as it leaves its maker"),
            c.baud, {0, 1'000'000});
  int parity = static_cast<int>(std::find(std::begin(kParityOf), std::end(kParityOf), c.parity) -
                                std::begin(kParityOf));
  v.one_of(Key("parity", "of a serial port").by_default("as it leaves its maker"), parity,
           kParities);
  if (parity < static_cast<int>(std::size(kParityOf))) c.parity = kParityOf[parity];
  v.choice({"mode", "it sends by itself, or answers"}, c.polled, {"stream", "poll"});
  v.integer({"interval_ms", "of questions"}, c.interval_ms, {5, 10'000});
  v.number(Key("unit_m", "length of one count").by_default("0: as it leaves its maker"), c.unit_m,
           {0, 1});
  v.number({"scale", "its distances are multiplied by: found by calibration"}, c.scale, {0.9, 1.1});
  v.number({"accuracy_m", "standard deviation of a reading"}, c.accuracy_m, {0.0001, 1});
  v.number({"min_m", "least reading that is not refused"}, c.min_m, {-10'000, 10'000});
  v.number({"max_m", "largest reading that is not refused"}, c.max_m, {-10'000, 10'000});
  v.integer({"silence_ms", "no telegram for longer: failed, connected anew"}, c.silence_ms,
            {50, 60'000});
  v.text({"question", "device: text: what it is asked with; empty: it streams"}, c.question, 64);
  v.section(Key("telegram", "how the PLC's telegram is laid out").required(), c.telegram,
            {c.device == Device::kTelegram, "device: telegram"});
  v.section(Key("modbus", "which registers are read").required(), c.modbus,
            {c.device == Device::kModbus, "device: modbus"});
  if (YamlReader* y = v.reading(); y != nullptr) check(*y, c, known);
}

const std::string& device_name(RangefinderConfig::Device device) {
  return kDevices[static_cast<std::size_t>(device)];
}

const std::string& axis_name(RangefinderConfig::Axis axis) {
  return kAxes[static_cast<std::size_t>(axis)];
}

void keys(KeyVisitor& v, std::vector<RangefinderConfig>& rangefinders) {
  v.list(
      {"rangefinders", "lasers and PLCs that are connected to this host; none: a recording plays"},
      rangefinders, kMost, check_pair);
}

}  // namespace crane
