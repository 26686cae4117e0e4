// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>

#include "config/site_config.hpp"
#include "dds/participant.hpp"
#include "service/exit_code.hpp"
#include "service/status_reporter.hpp"

namespace CLI {
class App;
}

namespace crane {

/// What the body of a service gets: configuration read, network joined, signals handled.
struct ServiceContext {
  SiteConfig config;
  std::string config_file;  ///< empty: all defaults
  std::shared_ptr<dds::Participant> participant;
  StatusReporter status;

  /// True after SIGTERM or SIGINT.
  [[nodiscard]] bool stopping() const;
  /// True once after each SIGHUP: the zones of the configuration are to be read again.
  [[nodiscard]] bool reload() const;
};

struct ServiceInfo {
  std::string name;         ///< "cranemap-camera"
  std::string description;  ///< first lines of --help
  std::uint32_t service;    ///< v1::SERVICE_*
  /// What of the settings the command line decides; may be empty.
  std::function<Result<void>(dds::Settings&)> adjust = {};
};

/// The whole main() of a service: arguments, configuration, log, network, signals, last status.
/// Returns the exit code: 0, 2 configuration, 3 resource.
int run_service(int argc, char** argv, const ServiceInfo& info,
                const std::function<void(CLI::App&)>& add_options,
                const std::function<Result<void>(ServiceContext&)>& body);

/// Sets the flags behind stopping() and reload() on SIGTERM, SIGINT and SIGHUP; ignores SIGPIPE.
void handle_signals();

/// An exception that nothing caught, of any thread, memory that ran out included, ends the program
/// with its text in the log and exit code 3, not by SIGABRT.
void end_on_exceptions();
bool stop_requested();
/// True once after each SIGHUP.
bool reload_requested();

/// `identity`: for DDS Security, where the configuration names none.
dds::Settings to_settings(const SiteConfig& config, const std::string& identity);

}  // namespace crane
