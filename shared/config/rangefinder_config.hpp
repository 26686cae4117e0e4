#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace crane {

/// A number in a PLC's telegram or registers.
enum class PlcNumber { kInt16, kUint16, kInt32, kUint32, kFloat32, kFloat64 };
constexpr std::size_t plc_bytes(PlcNumber type) {
  return type == PlcNumber::kFloat64                               ? 8
         : type == PlcNumber::kInt16 || type == PlcNumber::kUint16 ? 2
                                                                   : 4;
}

/// device: telegram. Offsets in bytes.
struct PlcTelegramConfig {
  int length = 0;  ///< 1..512
  int value_offset = 0;
  PlcNumber value_type = PlcNumber::kInt32;
  int heartbeat_offset = -1;  ///< -1 = none
  PlcNumber heartbeat_type = PlcNumber::kUint16;
  bool little_endian = false;
  double unit_m = 0;       ///< RangefinderConfig's
  bool datagrams = false;  ///< by its port
};

/// device: modbus. Registers as the protocol counts them, from 0.
struct ModbusConfig {
  int unit = 1;
  int value_register = 0;
  PlcNumber type = PlcNumber::kInt32;
  bool input_registers = false;
  bool low_word_first = false, swap_bytes = false;
  int heartbeat_register = -1;  ///< -1 = none
};

/// A rangefinder, or a PLC that knows the position, connected to this host.
struct RangefinderConfig {
  enum class Axis { kCart, kTrolley };
  enum class Device {
    kSickDl100,
    kSickDl50,
    kSickDt1000,
    kDimetix,
    kBenewake,
    kLeuzeBps,
    kText,
    kTelegram,
    kModbus,
    kWcs
  };
  Axis axis = Axis::kCart;
  Device device = Device::kText;
  /// "/dev/ttyUSB0", "tcp://host:port", or "udp://host:port": datagrams of that host on our port.
  std::string port;
  int baud = 0;          ///< 0 = as it leaves its maker
  char parity = 0;       ///< N, E, O; 0 = likewise
  bool polled = false;   ///< mode: stream | poll
  int interval_ms = 50;  ///< of questions; 5..10'000
  double unit_m = 0;     ///< of one count; 0 = as it leaves its maker
  double scale = 1;      ///< of its distances, found by calibration; 0.9..1.1
  double accuracy_m = 0.005;
  double min_m = 0.05, max_m = 300;  ///< of a reading; outside it is refused
  int silence_ms = 500;              ///< no telegram for longer: failed, connected anew
  std::string question;              ///< device: text; empty = it streams
  PlcTelegramConfig telegram;
  ModbusConfig modbus;
};

/// As `device` names it.
const std::string& device_name(RangefinderConfig::Device device);
const std::string& axis_name(RangefinderConfig::Axis axis);

class YamlReader;
/// Of the sequence `rangefinders`. Problems are told to the reader.
std::vector<RangefinderConfig> read_rangefinders(YamlReader& file);
std::string to_yaml(const std::vector<RangefinderConfig>& rangefinders);

}  // namespace crane
