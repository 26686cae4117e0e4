// SPDX-License-Identifier: Apache-2.0
#include "sensors/distance/modbus_source.hpp"

#include <modbus/modbus.h>

#include <cerrno>
#include <cmath>
#include <thread>
#include <vector>

#include "sensors/distance/plc_telegram.hpp"

namespace crane {
namespace {

constexpr int kAnswerMs = 500;
constexpr std::chrono::milliseconds kStandsStill{1000};

}  // namespace

struct ModbusSource::Connection {
  modbus_t* context;

  explicit Connection(modbus_t* made) : context(made) {}
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;
  ~Connection() {
    modbus_close(context);
    modbus_free(context);
  }
};

ModbusSource::ModbusSource(const RangefinderConfig& config) : config_(config) {}
ModbusSource::~ModbusSource() = default;

Result<void> ModbusSource::open() {
  connection_.reset();
  same_ = -1;
  const std::string rest = config_.port.substr(std::string("tcp://").size());
  const auto colon = rest.rfind(':');
  const std::string host = rest.substr(0, colon);
  const std::string port = colon == std::string::npos ? "502" : rest.substr(colon + 1);
  modbus_t* context = modbus_new_tcp_pi(host.c_str(), port.c_str());
  if (context == nullptr)
    return Error{ErrorCode::kResource, config_.port, modbus_strerror(errno), "check host and port"};
  connection_ = std::make_unique<Connection>(context);
  modbus_set_response_timeout(context, 0, kAnswerMs * 1000);
  modbus_set_slave(context, config_.modbus.unit);
  if (modbus_connect(context) != 0) {
    const std::string why = modbus_strerror(errno);
    connection_.reset();
    return Error{ErrorCode::kResource, config_.port, "no connection: " + why,
                 "is the PLC's Modbus server switched on, and reachable from here?"};
  }
  next_ = std::chrono::steady_clock::now();
  return {};
}

Result<void> ModbusSource::read(int first, int count, std::uint16_t* out) {
  const int got = config_.modbus.input_registers
                      ? modbus_read_input_registers(connection_->context, first, count, out)
                      : modbus_read_registers(connection_->context, first, count, out);
  if (got == count) return {};
  if (errno == EMBXILADD || errno == EMBXILVAL || errno == EMBXILFUN)
    return Error{
        ErrorCode::kConfiguration, config_.port,
        "the PLC has no register " + std::to_string(first) + " (" + modbus_strerror(errno) + ")",
        "check modbus.register, and holding against input registers"};
  return Error{ErrorCode::kResource, config_.port,
               std::string("no answer: ") + modbus_strerror(errno), "it is tried again"};
}

Result<void> ModbusSource::listen(std::chrono::milliseconds limit, DeviceTalk& out) {
  using Kind = DeviceSaid::Kind;
  if (!connection_) return Error{ErrorCode::kResource, config_.port, "is not open", ""};
  const auto now = std::chrono::steady_clock::now();
  if (now < next_) {
    std::this_thread::sleep_for(std::min<std::chrono::nanoseconds>(next_ - now, limit));
    if (std::chrono::steady_clock::now() < next_) return {};
  }
  next_ = std::max(next_ + std::chrono::milliseconds(config_.interval_ms), now);
  const ModbusConfig& m = config_.modbus;
  if (m.heartbeat_register >= 0) {
    std::uint16_t beat = 0;
    if (auto good = read(m.heartbeat_register, 1, &beat); !good) return good;
    same_ = same_ >= 0 && beat == heartbeat_ ? same_ + 1 : 0;
    heartbeat_ = beat;
    if (same_ * config_.interval_ms >= kStandsStill.count()) {
      out.push_back({Kind::kFault, 0, "the PLC's heartbeat stands still", 0});
      return {};
    }
  }
  const std::size_t bytes = plc_bytes(m.type);
  std::vector<std::uint16_t> words(bytes / 2);
  if (auto good = read(m.value_register, static_cast<int>(words.size()), words.data()); !good)
    return good;
  std::vector<std::uint8_t> raw;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::uint16_t word = words[m.low_word_first ? words.size() - 1 - i : i];
    const auto high = static_cast<std::uint8_t>(word >> 8U);
    const auto low = static_cast<std::uint8_t>(word & 0xFFU);
    raw.push_back(m.swap_bytes ? low : high);
    raw.push_back(m.swap_bytes ? high : low);
  }
  const double value = plc_number(raw, m.type, false);
  if (std::isnan(value)) {
    ++damaged_;
    out.push_back({Kind::kNoDistance, 0, "the PLC's number is none", 0});
  } else {
    out.push_back({Kind::kDistance, value * config_.unit_m, "", 0});
  }
  return {};
}

void ModbusSource::close() {
  connection_.reset();
}

}  // namespace crane
