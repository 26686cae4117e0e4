// SPDX-License-Identifier: Apache-2.0
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

/// device: telegram.
struct PlcTelegramConfig {
  int length = 0;
  int value_offset = 0;
  PlcNumber value_type = PlcNumber::kInt32;
  int heartbeat_offset = -1;  ///< -1 = none
  PlcNumber heartbeat_type = PlcNumber::kUint16;
  bool little_endian = false;
  double unit_m = 0;       ///< RangefinderConfig's
  bool datagrams = false;  ///< by its port
};

/// device: modbus.
struct ModbusConfig {
  int unit = 1;
  int value_register = 0;
  PlcNumber type = PlcNumber::kInt32;
  bool input_registers = false;
  bool low_word_first = false, swap_bytes = false;
  int heartbeat_register = -1;  ///< -1 = none
};

/// Of list `rangefinders`: a rangefinder, or a PLC that knows the position, connected to this host.
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
  std::string port;
  int baud = 0;     ///< 0 = as it leaves its maker
  char parity = 0;  ///< N, E, O; 0 = likewise
  bool polled = false;
  int interval_ms = 50;
  double unit_m = 0;  ///< 0 = as it leaves its maker
  double scale = 1;
  double accuracy_m = 0.005;
  double min_m = 0.05, max_m = 300;
  int silence_ms = 500;
  std::string question;
  PlcTelegramConfig telegram;
  ModbusConfig modbus;
};

/// As `device` names it.
const std::string& device_name(RangefinderConfig::Device device);
const std::string& axis_name(RangefinderConfig::Axis axis);

class KeyVisitor;
/// All of them: what one must be, and what two may not have in common.
void keys(KeyVisitor& v, std::vector<RangefinderConfig>& rangefinders);

}  // namespace crane
