// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>

#include "base/log.hpp"
#include "commands.hpp"
#include "doctor.hpp"
#include "service/exit_code.hpp"
#include "site_options.hpp"

namespace crane {
namespace {

struct Options {
  SiteOptions site;
  double seconds = 3;
};

void print(const Finding& f) {
  const bool colour = isatty(1) != 0;
  constexpr const char* kWords[] = {"good", "warn", "BAD "};
  constexpr const char* kColours[] = {"\x1b[32m", "\x1b[33m", "\x1b[31m"};
  const auto verdict = static_cast<int>(f.verdict);
  std::printf("%s%s%s  %-15s %s\n", colour ? kColours[verdict] : "", kWords[verdict],
              colour ? "\x1b[0m" : "", f.what.c_str(), f.text.c_str());
  if (!f.advice.empty()) std::printf("%23s-> %s\n", "", f.advice.c_str());
}

int doctor(const Options& options) {
  auto site = read_site(options.site);
  if (!site) {
    log_error(site.error().text());
    return exit_code(site.error());
  }
  int bad = 0;
  const auto show = [&bad](const std::vector<Finding>& findings) {
    for (const Finding& f : findings) {
      print(f);
      bad += f.verdict == Finding::Verdict::kBad ? 1 : 0;
    }
    std::fflush(stdout);
  };
  show(examine_host(*site));
  show(examine_rangefinders(*site));
  show(examine_camera(*site));
  if (options.seconds > 0) show(examine_network(*site, options.seconds));
  std::printf("%s\n", bad == 0 ? "nothing is in the way" : "the lines marked BAD are in the way");
  return bad == 0 ? kExitOk : kExitResource;
}

}  // namespace

Command add_doctor_command(CLI::App& app) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand(
      "doctor",
      "Why does no data come? Checks what the configured network needs of this host, what its\n"
      "camera and rangefinders say, then who is on it and whose QoS, type, partition or clock does "
      "not fit; "
      "says what to do.\n"
      "Exit code 0: nothing is in the way; 3: something is.");
  add_site_options(*command, options->site);
  command->add_option("--seconds", options->seconds, "How long to look at the network; 0 = not")
      ->check(CLI::Range(0.0, 600.0))
      ->capture_default_str();
  return [options] { return doctor(*options); };
}

}  // namespace crane
