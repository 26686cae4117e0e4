// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "base/loop_watch.hpp"
#include "base/result.hpp"
#include "http/server.hpp"

namespace crane {

/// What a service says of itself over HTTP: `/metrics` for Prometheus, `/healthz` (each of its
/// threads turns and nothing failed; 200 or 503) and `/readyz` (all is well; 200 or 503). Answers
/// come from a thread of its own, from what was told last and from who turns now.
class HealthServer {
 public:
  /// `port` 0: any that is free; `hosts`: as http::Router has them. Error: Resource when the port
  /// cannot be had.
  static Result<std::unique_ptr<HealthServer>> start(
      const std::string& address, int port, const std::vector<std::string>& hosts = {},
      const LoopWatch& watch = LoopWatch::of_process());
  ~HealthServer();

  struct Word {
    bool healthy = true, ready = true;
    std::string text;     ///< why not, one line
    std::string metrics;  ///< Prometheus text format
    std::uint32_t crane = 0, service = 0;
  };
  /// To be told every second.
  void tell(Word word);
  [[nodiscard]] int port() const;
  [[nodiscard]] http::Server::Counts counts() const;

 private:
  struct Impl;
  explicit HealthServer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Asks a running service for /healthz. Error: NotAvailable when none answers; Resource, with what
/// it said.
Result<void> ask_health(const std::string& address, int port);

}  // namespace crane
