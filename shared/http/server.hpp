// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include "base/result.hpp"
#include "http/router.hpp"

namespace crane::http {

/// What anybody may take of us.
struct Limits {
  /// From the connection to the last byte of the answer, however it trickles.
  std::chrono::milliseconds deadline{2000};
  /// When there is one more, the oldest is closed: who holds connections open keeps nobody out.
  std::size_t connections = 64;
  std::size_t request_bytes = 8192;  ///< its lines; a body is not taken
};

/// A small HTTP/1.1 server in a thread of its own: one request a connection, each answered by the
/// router. Ranges are not known: all of an answer or nothing. Any thread.
class Server {
 public:
  /// `port` 0: any that is free. Error: Resource when it cannot be listened at.
  static Result<std::unique_ptr<Server>> start(const std::string& address, int port, Router router,
                                               const Limits& limits = {});
  /// At once, whoever is connected.
  ~Server();

  [[nodiscard]] int port() const;

  struct Counts {
    std::uint64_t answered = 0;
    std::uint64_t refused = 0;  ///< answered with an error, or no HTTP
    std::uint64_t closed = 0;   ///< too slow, or one too many
  };
  [[nodiscard]] Counts counts() const;

 private:
  struct Impl;
  explicit Server(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace crane::http
