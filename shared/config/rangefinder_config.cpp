#include "config/rangefinder_config.hpp"

#include <algorithm>
#include <sstream>

#include "config/yaml_reader.hpp"
#include "config/yaml_text.hpp"

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

void number_type(YamlReader& y, const char* key, PlcNumber& type) {
  int choice = static_cast<int>(type);
  y.choice(key, kNumbers, choice);
  type = static_cast<PlcNumber>(choice);
}

void read_telegram(YamlReader y, PlcTelegramConfig& c) {
  y.integer("length", c.length, 1, 512, true);
  y.integer("value_offset", c.value_offset, 0, 510, true);
  number_type(y, "value_type", c.value_type);
  y.integer("heartbeat_offset", c.heartbeat_offset, -1, 510);
  number_type(y, "heartbeat_type", c.heartbeat_type);
  y.flag("little_endian", c.little_endian);
  const auto inside = [&](const char* key, int offset, PlcNumber type) {
    if (offset >= 0 && offset + static_cast<int>(plc_bytes(type)) > c.length)
      y.problem(key, "lies beyond the end of the telegram");
  };
  inside("value_offset", c.value_offset, c.value_type);
  inside("heartbeat_offset", c.heartbeat_offset, c.heartbeat_type);
}

void read_modbus(YamlReader y, ModbusConfig& c) {
  int registers = c.input_registers ? 1 : 0;
  y.integer("unit", c.unit, 0, 255);
  y.integer("value_register", c.value_register, 0, 65'535, true);
  number_type(y, "value_type", c.type);
  y.choice("registers", {"holding", "input"}, registers);
  c.input_registers = registers == 1;
  y.flag("low_word_first", c.low_word_first);
  y.flag("swap_bytes", c.swap_bytes);
  y.integer("heartbeat_register", c.heartbeat_register, -1, 65'535);
}

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

RangefinderConfig read_one(YamlReader& y) {
  RangefinderConfig c;
  int axis = 0;
  int device = -1;
  int parity = -1;
  int mode = 0;
  if (!y.has("axis")) y.problem("axis", "is missing: cart or trolley");
  y.choice("axis", kAxes, axis);
  c.axis = static_cast<RangefinderConfig::Axis>(axis);
  if (!y.has("device")) y.problem("device", "is missing");
  y.choice("device", kDevices, device);
  c.device = device >= 0 ? static_cast<Device>(device) : Device::kText;
  y.text("port", c.port, true);
  y.integer("baud", c.baud, 0, 1'000'000);
  y.choice("parity", kParities, parity);
  c.parity = parity >= 0 ? kParityOf[parity] : '\0';
  y.choice("mode", {"stream", "poll"}, mode);
  c.polled = mode == 1;
  y.integer("interval_ms", c.interval_ms, 5, 10'000);
  y.number("unit_m", c.unit_m, 0, 1);
  if (device >= 0 && !has_own_unit(c.device) && c.unit_m == 0)
    y.problem("unit_m", "must be given for device: " + kDevices[std::size_t(device)] +
                            ": the length of one count, 0.001 for millimetres");
  y.number("scale", c.scale, 0.9, 1.1);
  y.number("accuracy_m", c.accuracy_m, 0.0001, 1);
  y.number("min_m", c.min_m, -10'000, 10'000);
  y.number("max_m", c.max_m, -10'000, 10'000);
  if (c.min_m >= c.max_m) y.problem("min_m", "must be less than max_m");
  y.integer("silence_ms", c.silence_ms, 50, 60'000);
  y.text("question", c.question);
  if (!c.question.empty() && c.device != Device::kText)
    y.problem("question", "is for device: text; the others know theirs");
  if (c.question.size() > 64) y.problem("question", "has more than 64 characters");
  if (c.device == Device::kTelegram) read_telegram(y.section("telegram", true), c.telegram);
  if (c.device == Device::kModbus) read_modbus(y.section("modbus", true), c.modbus);
  check_port(y, c);
  return c;
}

std::string one_to_yaml(const RangefinderConfig& c) {
  std::ostringstream s;
  s << "  - axis: " << axis_name(c.axis) << "\n"
    << "    device: " << device_name(c.device) << "\n"
    << "    port: " << yaml_quoted(c.port) << "\n"
    << "    baud: " << c.baud << "\n";
  if (c.parity != 0)
    s << "    parity: "
      << kParities[std::size_t(std::find(std::begin(kParityOf), std::end(kParityOf), c.parity) -
                               std::begin(kParityOf))]
      << "\n";
  s << "    mode: " << (c.polled ? "poll" : "stream") << "\n"
    << "    interval_ms: " << c.interval_ms << "\n"
    << "    unit_m: " << yaml_exact(c.unit_m) << "\n"
    << "    scale: " << yaml_exact(c.scale) << "\n"
    << "    accuracy_m: " << yaml_exact(c.accuracy_m) << "\n"
    << "    min_m: " << yaml_exact(c.min_m) << "\n"
    << "    max_m: " << yaml_exact(c.max_m) << "\n"
    << "    silence_ms: " << c.silence_ms << "\n";
  if (!c.question.empty()) s << "    question: " << yaml_quoted(c.question) << "\n";
  const auto type = [](PlcNumber t) { return kNumbers[static_cast<std::size_t>(t)]; };
  const auto flag = [](bool value) { return value ? "true" : "false"; };
  if (c.device == Device::kTelegram)
    s << "    telegram: {length: " << c.telegram.length
      << ", value_offset: " << c.telegram.value_offset
      << ", value_type: " << type(c.telegram.value_type)
      << ", heartbeat_offset: " << c.telegram.heartbeat_offset
      << ", heartbeat_type: " << type(c.telegram.heartbeat_type)
      << ", little_endian: " << flag(c.telegram.little_endian) << "}\n";
  if (c.device == Device::kModbus)
    s << "    modbus: {unit: " << c.modbus.unit << ", value_register: " << c.modbus.value_register
      << ", value_type: " << type(c.modbus.type)
      << ", registers: " << (c.modbus.input_registers ? "input" : "holding")
      << ", low_word_first: " << flag(c.modbus.low_word_first)
      << ", swap_bytes: " << flag(c.modbus.swap_bytes)
      << ", heartbeat_register: " << c.modbus.heartbeat_register << "}\n";
  return s.str();
}

}  // namespace

const std::string& device_name(RangefinderConfig::Device device) {
  return kDevices[static_cast<std::size_t>(device)];
}

const std::string& axis_name(RangefinderConfig::Axis axis) {
  return kAxes[static_cast<std::size_t>(axis)];
}

std::vector<RangefinderConfig> read_rangefinders(YamlReader& file) {
  std::vector<RangefinderConfig> out;
  for (YamlReader& y : file.items("rangefinders")) {
    RangefinderConfig c = read_one(y);
    for (const RangefinderConfig& other : out) {
      if (other.axis == c.axis) y.problem("axis", "has another rangefinder in this list");
      const bool shares = c.device == other.device &&
                          (c.device == Device::kModbus || c.device == Device::kTelegram);
      if (other.port == c.port && !shares) y.problem("port", "is that of another rangefinder too");
      if (other.port == c.port && c.device == Device::kTelegram &&
          c.telegram.length != other.telegram.length)
        y.problem("telegram", "has another length than that of the same port");
    }
    out.push_back(std::move(c));
  }
  if (out.size() > kMost) file.problem("rangefinders", "are more than 4");
  return out;
}

std::string to_yaml(const std::vector<RangefinderConfig>& rangefinders) {
  std::string out = rangefinders.empty() ? "" : "rangefinders:\n";
  for (const RangefinderConfig& c : rangefinders) out += one_to_yaml(c);
  return out;
}

}  // namespace crane
