#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "base/result.hpp"

namespace crane {

/// What a service says of itself over HTTP: `/metrics` for Prometheus, `/healthz` (its loop turns
/// and nothing failed; 200 or 503) and `/readyz` (all is well; 200 or 503). Answers come from a
/// thread of its own, from what was told last.
class HealthServer {
 public:
  /// Error: Resource when the port cannot be had.
  static Result<std::unique_ptr<HealthServer>> start(const std::string& address, int port);
  ~HealthServer();

  struct Word {
    bool healthy = true, ready = true;
    std::string text;     ///< why not, one line
    std::string metrics;  ///< Prometheus text format
  };
  /// To be told every second; silent for 30 s is not healthy.
  void tell(Word word);

 private:
  struct Impl;
  explicit HealthServer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Asks a running service for /healthz. Error: NotAvailable when none answers; Resource, with what
/// it said.
Result<void> ask_health(const std::string& address, int port);

}  // namespace crane
