// SPDX-License-Identifier: Apache-2.0
#include "sensors/distance/modbus_emulator.hpp"

#include <arpa/inet.h>
#include <modbus/modbus.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cmath>
#include <limits>
#include <vector>

namespace crane {
namespace {

constexpr std::size_t kMostClients = 4;

/// Its bytes, the highest first.
std::vector<std::uint8_t> bytes_of(double value, PlcNumber type) {
  const std::size_t count = plc_bytes(type);
  std::uint64_t raw = 0;
  if (type == PlcNumber::kFloat32)
    raw = std::bit_cast<std::uint32_t>(static_cast<float>(value));
  else if (type == PlcNumber::kFloat64)
    raw = std::bit_cast<std::uint64_t>(value);
  else
    raw = static_cast<std::uint64_t>(std::llround(value));
  std::vector<std::uint8_t> out;
  for (std::size_t i = count; i-- > 0;) out.push_back(static_cast<std::uint8_t>(raw >> (8 * i)));
  return out;
}

}  // namespace

struct ModbusEmulator::Server {
  RangefinderConfig config;
  modbus_t* context = nullptr;
  modbus_mapping_t* registers = nullptr;
  int listener = -1;
  std::vector<int> clients;
  std::uint16_t beat = 0;

  Server() = default;
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;
  ~Server() {
    for (const int client : clients) close(client);
    if (listener >= 0) close(listener);
    modbus_mapping_free(registers);
    modbus_free(context);
  }
  /// One question of this client. False: it is gone, or says what is no Modbus.
  bool serve(int client) const {
    std::array<std::uint8_t, MODBUS_TCP_MAX_ADU_LENGTH> question{};
    modbus_set_socket(context, client);
    const int length = modbus_receive(context, question.data());
    if (length < 0) return false;
    return length == 0 || modbus_reply(context, question.data(), length, registers) >= 0;
  }
};

ModbusEmulator::ModbusEmulator(std::unique_ptr<Server> server) : server_(std::move(server)) {}
ModbusEmulator::~ModbusEmulator() = default;

Result<std::unique_ptr<ModbusEmulator>> ModbusEmulator::listen(const RangefinderConfig& config) {
  const std::string rest = config.port.substr(std::string("tcp://").size());
  const auto colon = rest.rfind(':');
  const std::string host = rest.substr(0, colon);
  const std::string service = colon == std::string::npos ? "502" : rest.substr(colon + 1);
  const auto refuse = [&](const std::string& why) {
    return Error{ErrorCode::kResource, config.port, "cannot be emulated: " + why,
                 "choose another --port tcp://address:port"};
  };
  auto server = std::make_unique<Server>();
  server->config = config;
  const ModbusConfig& m = config.modbus;
  const int count = std::max(m.value_register + 4, m.heartbeat_register + 1);
  server->context = modbus_new_tcp_pi(host.c_str(), service.c_str());
  // Only what the configuration reads is there: another register is an error, as with a PLC.
  server->registers =
      modbus_mapping_new(0, 0, m.input_registers ? 0 : count, m.input_registers ? count : 0);
  if (server->context == nullptr || server->registers == nullptr)
    return refuse(modbus_strerror(errno));
  modbus_set_slave(server->context, m.unit);
  modbus_set_indication_timeout(server->context, 0, 200'000);
  server->listener = modbus_tcp_pi_listen(server->context, 1);
  if (server->listener < 0) return refuse(modbus_strerror(errno));
  return std::unique_ptr<ModbusEmulator>(new ModbusEmulator(std::move(server)));
}

std::uint16_t ModbusEmulator::port() const {
  sockaddr_storage at{};
  socklen_t size = sizeof at;
  if (getsockname(server_->listener, reinterpret_cast<sockaddr*>(&at), &size) != 0) return 0;
  // The port stands at the same place in both families.
  return ntohs(reinterpret_cast<const sockaddr_in&>(at).sin_port);
}

void ModbusEmulator::measure(const EmulatedMeasurement& now) {
  const ModbusConfig& m = server_->config.modbus;
  std::uint16_t* all = m.input_registers ? server_->registers->tab_input_registers
                                         : server_->registers->tab_registers;
  const bool real = m.type == PlcNumber::kFloat32 || m.type == PlcNumber::kFloat64;
  const double none = real ? std::numeric_limits<double>::quiet_NaN() : 0;
  const std::vector<std::uint8_t> bytes =
      bytes_of(now.no_target ? none : now.distance_m / server_->config.unit_m, m.type);
  const std::size_t words = bytes.size() / 2;
  for (std::size_t i = 0; i < words; ++i) {
    const std::size_t from = m.low_word_first ? words - 1 - i : i;
    const std::uint8_t high = bytes[2 * from + (m.swap_bytes ? 1 : 0)];
    const std::uint8_t low = bytes[2 * from + (m.swap_bytes ? 0 : 1)];
    all[static_cast<std::size_t>(m.value_register) + i] =
        static_cast<std::uint16_t>(high << 8U | low);
  }
  if (!now.broken) ++server_->beat;
  if (m.heartbeat_register >= 0)
    all[static_cast<std::size_t>(m.heartbeat_register)] = server_->beat;
}

void ModbusEmulator::answer(std::chrono::milliseconds limit) {
  Server& s = *server_;
  std::vector<pollfd> waits = {{s.listener, POLLIN, 0}};
  for (const int client : s.clients) waits.push_back({client, POLLIN, 0});
  if (poll(waits.data(), waits.size(), static_cast<int>(limit.count())) <= 0) return;
  for (std::size_t i = 1; i < waits.size(); ++i) {
    if (waits[i].revents == 0 || s.serve(waits[i].fd)) continue;
    close(waits[i].fd);
    s.clients.erase(std::find(s.clients.begin(), s.clients.end(), waits[i].fd));
  }
  if (waits[0].revents == 0) return;
  const int client = accept4(s.listener, nullptr, nullptr, SOCK_CLOEXEC);
  if (client < 0) return;
  if (s.clients.size() < kMostClients)
    s.clients.push_back(client);
  else
    close(client);
}

}  // namespace crane
