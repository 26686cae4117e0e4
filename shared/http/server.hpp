// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "base/result.hpp"
#include "http/router.hpp"
#include "http/tls.hpp"

namespace crane::http {

/// What anybody may take of us.
struct Limits {
  /// From the connection to the last byte of the answer, however it trickles.
  std::chrono::milliseconds deadline{2000};
  /// When there is one more, the oldest is closed: who holds connections open keeps nobody out.
  std::size_t connections = 64;
  std::size_t request_bytes = 8192;  ///< its lines
  std::size_t body_bytes = 0;        ///< 0: a body is not taken
  /// For an answer that is large, or is thought about for long: from then on. 0: within `deadline`.
  std::chrono::milliseconds answer_deadline{0};
  std::size_t streams = 64;  ///< WebSockets; one more is refused
  /// A WebSocket client that says nothing for so long, not even that it got a ping, is cut off.
  std::chrono::milliseconds stream_idle{10'000};
  int threads = 1;  ///< more: a handler that thinks keeps others waiting less
};

/// A small HTTP/1.1 server in threads of its own: one request a connection, each answered by the
/// router, or a WebSocket. Ranges are not known: all of an answer or nothing. Any thread.
class Server {
 public:
  /// `port` 0: any that is free; `tls`: it speaks that alone. Error: Resource when it cannot be
  /// listened at, Configuration when the files of `tls` are not sound.
  static Result<std::unique_ptr<Server>> start(const std::string& address, int port, Router router,
                                               const Limits& limits = {},
                                               const std::optional<TlsFiles>& tls = {});
  /// At once, whoever is connected.
  ~Server();

  [[nodiscard]] int port() const;
  /// Every feed that waits is asked for its next message.
  void wake();

  struct Counts {
    std::uint64_t answered = 0;
    std::uint64_t refused = 0;  ///< answered with an error, or no HTTP
    std::uint64_t closed = 0;   ///< too slow, or one too many
    std::uint64_t streams = 0;  ///< WebSockets now
    std::uint64_t cut_off = 0;  ///< WebSockets that stalled, or said what is no part of theirs
  };
  [[nodiscard]] Counts counts() const;

 private:
  struct Impl;
  explicit Server(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace crane::http
