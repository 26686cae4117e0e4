// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <span>
#include <string>

#include "base/result.hpp"
#include "sensors/distance/distance_protocol.hpp"

namespace crane {

/// An open way to a device that speaks bytes: a serial line ("/dev/ttyUSB0"), a TCP connection that
/// we make ("tcp://host:port": serial servers, PLCs), or datagrams that we receive from one host
/// ("udp://host:port": the port is ours). Closes itself.
class ByteLink {
 public:
  /// Waits at most 2 s for a TCP connection. Error: Resource, with what to do: no such device, no
  /// permission, in use by another program, refused, no route; Configuration: a baud rate that
  /// this host does not know.
  static Result<ByteLink> open(const std::string& port, const SerialLine& line);
  ~ByteLink();
  ByteLink(ByteLink&& other) noexcept;
  ByteLink& operator=(ByteLink&&) = delete;

  /// What has arrived, or arrives within `limit`; 0 = nothing. Of datagrams one.
  /// Error: Resource when the device or the connection is gone.
  Result<std::size_t> read(std::span<std::uint8_t> into, std::chrono::milliseconds limit);
  /// Error: likewise, or when it takes nothing for 0.2 s.
  Result<void> write(const std::string& bytes);
  /// Of datagrams that came from elsewhere and were not looked at.
  [[nodiscard]] std::uint64_t strangers() const { return strangers_; }
  /// Time that so many bytes take on the line [ns]; 0 over a network.
  [[nodiscard]] std::int64_t line_time_ns(std::size_t bytes) const;

 private:
  ByteLink(int fd, std::string port) : fd_(fd), port_(std::move(port)) {}
  static Result<ByteLink> open_serial(const std::string& port, const SerialLine& line);
  static Result<ByteLink> open_tcp(const std::string& port);
  static Result<ByteLink> open_udp(const std::string& port);

  int fd_ = -1;
  std::string port_;
  int baud_ = 0;  ///< of a serial line
  bool datagrams_ = false;
  std::uint32_t from_ = 0;  ///< datagrams: only of this IPv4 address, network order; 0 = any
  std::uint64_t strangers_ = 0;
};

}  // namespace crane
