#include "service/run_service.hpp"

#include <signal.h>

#include <CLI/CLI.hpp>

#include "base/log.hpp"

namespace crane {
namespace {

std::atomic<bool>& stop_flag() {
  static std::atomic<bool> stop{false};
  return stop;
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
  signal(SIGPIPE, SIG_IGN);
}

bool stop_requested() {
  return stop_flag();
}

bool ServiceContext::stopping() const {
  return stop_requested();
}

dds::Settings to_settings(const SiteConfig& config) {
  dds::Settings s;
  s.crane = static_cast<std::uint32_t>(config.crane);
  s.domain = static_cast<std::uint32_t>(config.dds.domain);
  s.transport = config.dds.udp_only ? dds::Transport::kUdp : dds::Transport::kAuto;
  s.interfaces = config.dds.interfaces;
  s.shm_segment_bytes = static_cast<std::uint32_t>(config.dds.shm_segment_mib) << 20U;
  s.udp_buffer_bytes = static_cast<std::uint32_t>(config.dds.udp_buffer_kib) << 10U;
  s.profile_file = config.dds.profile_file;
  s.profile_name = config.dds.profile_name;
  return s;
}

int run_service(int argc, char** argv, const ServiceInfo& info,
                const std::function<void(CLI::App&)>& add_options,
                const std::function<Result<void>(ServiceContext&)>& body) {
  set_log_name(info.name);
  handle_signals();
  CLI::App app(info.description, info.name);
  app.set_version_flag("--version", std::string(CRANEMAP_VERSION) + " (" CRANEMAP_BUILD_TYPE ")");
  std::string config_file;
  app.add_option("--config", config_file, "Site configuration (YAML); defaults without it");
  add_options(app);
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
  log_info("version " CRANEMAP_VERSION " (" CRANEMAP_BUILD_TYPE "), configuration:\n" +
           to_yaml(config));
  if (std::string(CRANEMAP_BUILD_TYPE) != "Release")
    log_warning("not an optimised build (" CRANEMAP_BUILD_TYPE "): expect it to be slow");

  auto participant = dds::Participant::create(to_settings(config), info.name);
  if (!participant) return fail(participant.error());
  auto status = StatusReporter::create(*participant, info.service);
  if (!status) return fail(status.error());
  ServiceContext context{config, *participant, std::move(*status)};
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
