// SPDX-License-Identifier: Apache-2.0
#include "service/run_service.hpp"

#include <signal.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cstdlib>
#include <exception>
#include <memory>
#include <new>
#include <string>

#include "base/log.hpp"
#include "service/decimal_options.hpp"
#include "service/service_name.hpp"

namespace crane {
namespace {

std::atomic<bool>& stop_flag() {
  static std::atomic<bool> stop{false};
  return stop;
}

std::atomic<bool>& reload_flag() {
  static std::atomic<bool> reload{false};
  return reload;
}

int fail(const Error& error) {
  log_error(error.text());
  return exit_code(error);
}

}  // namespace

void handle_signals() {
  struct sigaction action {};
  action.sa_handler = [](int) { stop_flag() = true; };
  sigaction(SIGTERM, &action, nullptr);
  sigaction(SIGINT, &action, nullptr);
  action.sa_handler = [](int) { reload_flag() = true; };
  sigaction(SIGHUP, &action, nullptr);
  signal(SIGPIPE, SIG_IGN);
}

void end_on_exceptions() {
  // To write the last line with, where there is no memory left.
  static auto reserve = std::make_unique<std::array<char, 1U << 18U>>();
  std::set_terminate([] {
    reserve.reset();
    alarm(2);  // the log may be held by the thread that threw
    std::string why;
    try {
      if (const std::exception_ptr thrown = std::current_exception())
        std::rethrow_exception(thrown);
      why = "ended without an exception: a bug";
    } catch (const std::bad_alloc&) {
      why = "memory ran out -> give it more ('ulimit -v', the container's limit)";
    } catch (const std::exception& e) {
      why = std::string("ended by what nothing expected: ") + e.what() +
            " -> a limit ('ulimit -a'), or a bug";
    } catch (...) {
      why = "ended by something thrown that is no exception: a bug";
    }
    log_error(why);
    // The log's own thread may be what there was no room for.
    if (!flush_log(std::chrono::milliseconds(300)))
      (void)!write(STDERR_FILENO, ("ERROR " + why + "\n").c_str(), why.size() + 7);
    std::_Exit(kExitResource);
  });
}

bool stop_requested() {
  return stop_flag();
}

bool ServiceContext::stopping() const {
  return stop_requested();
}

bool reload_requested() {
  return reload_flag().exchange(false);
}

bool ServiceContext::reload() const {
  return reload_requested();
}

dds::Settings to_settings(const SiteConfig& config, const std::string& identity) {
  dds::Settings s;
  static_cast<NetworkSettings&>(s) = config.dds;
  s.crane = static_cast<std::uint32_t>(config.crane);
  if (s.identity.empty()) s.identity = identity;
  return s;
}

int run_service(int argc, char** argv, const ServiceInfo& info,
                const std::function<void(CLI::App&)>& add_options,
                const std::function<Result<void>(ServiceContext&)>& body) {
  set_log_name(info.name);
  end_on_exceptions();
  handle_signals();
  CLI::App app(info.description, info.name);
  app.set_version_flag("--version", std::string(CRANEMAP_VERSION) + " (" CRANEMAP_BUILD_TYPE ")");
  std::string config_file;
  app.add_option("--config", config_file, "Site configuration (YAML); defaults without it");
  bool log_json = false;
  bool health = false;
  app.add_flag("--log-json", log_json, "The log as one JSON object a line");
  app.add_flag("--health", health,
               "Ask the running service of this configuration: 0 healthy, 3 not");
  // What a service cannot do without is not asked for by --health.
  if (std::any_of(argv, argv + argc, [](const char* a) { return std::string(a) == "--health"; }))
    app.allow_extras();
  else
    add_options(app);
  take_decimal_numbers(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kExitOk : kExitConfiguration;
  }
  SiteConfig config;
  if (!config_file.empty()) {
    auto read = read_site_config(config_file);
    if (!read) return fail(read.error());
    config = *read;
  }
  const int port = config.http.port == 0 ? 0 : config.http.port + static_cast<int>(info.service);
  if (health) {
    auto well = ask_health(config.http.address, port);
    return well ? kExitOk : fail(well.error());
  }
  if (log_json) set_log_format(LogFormat::kJson);
  log_info("version " CRANEMAP_VERSION " (" CRANEMAP_BUILD_TYPE "), configuration:\n" +
           to_yaml(config));
  if (std::string(CRANEMAP_BUILD_TYPE) != "Release")
    log_warning("not an optimised build (" CRANEMAP_BUILD_TYPE "): expect it to be slow");

  dds::Settings settings = to_settings(config, service_name(info.service));
  if (info.adjust)
    if (auto adjusted = info.adjust(settings); !adjusted) return fail(adjusted.error());
  auto participant = dds::Participant::create(settings, info.name);
  if (!participant) return fail(participant.error());
  auto status = StatusReporter::create(*participant, info.service);
  if (!status) return fail(status.error());
  ServiceContext context{config, config_file, *participant, std::move(*status)};
  if (port > 0)  // a map without its figures is better than none
    if (auto served = context.status.serve_http(config.http.address, port, config.http.hosts);
        !served)
      log_warning(served.error().text() + "; going on without /metrics and /healthz");
  const Result<void> done = body(context);
  if (!done) {
    context.status.status = 2;
    context.status.message = done.error().text();
  }
  context.status.flush(std::chrono::milliseconds(500));
  if (!done) return fail(done.error());
  log_info("stopped");
  return kExitOk;
}

}  // namespace crane
