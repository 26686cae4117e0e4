// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <cstdio>
#include <map>

#include "base/log.hpp"
#include "commands.hpp"
#include "config/reference.hpp"
#include "service/run_service.hpp"
#include "site_options.hpp"

namespace crane {
namespace {

struct Options {
  SiteOptions site;
  std::string action = "show", key;
};

int fail(const Error& error) {
  log_error(error.text());
  return exit_code(error);
}

/// The keys that are not as they are without a configuration, as the file says them.
std::string changes(const SiteConfig& site) {
  std::map<std::string, std::string> defaults, values;
  for (const KeyRow& row : values_of(SiteConfig{})) defaults[row.path] = row.value;
  for (const KeyRow& row : values_of(site)) values[row.path] = row.value;
  std::string out;
  for (const std::string& key : changed_keys(site, SiteConfig{})) {
    out += key + ": " + values[key];
    if (defaults.contains(key)) out += "   # default: " + defaults[key];
    out += "\n";
  }
  return out;
}

int config(const Options& o) {
  if (!o.key.empty() && o.action != "describe")
    return fail(Error{ErrorCode::kConfiguration, o.key, "a key is for 'config describe'",
                      "see 'cranemap config --help'"});
  std::string text;
  if (o.action == "describe") {
    auto described_key = described(o.key);
    if (!described_key) return fail(described_key.error());
    text = *described_key;
  } else if (o.action == "reference") {
    text = reference_page();
  } else {
    auto site = read_site(o.site);
    if (!site) return fail(site.error());
    text = o.action == "show" ? to_yaml(*site) : changes(*site);
  }
  std::fwrite(text.data(), 1, text.size(), stdout);
  return kExitOk;
}

}  // namespace

Command add_config_command(CLI::App& app) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand(
      "config",
      "What a configuration says, and what it may say.\n"
      "show       the effective configuration, every key; problems with their lines\n"
      "changed    only what differs from the defaults\n"
      "describe   unit, what is allowed, default and meaning, of KEY or of everything\n"
      "reference  the same as a page: docs/configuration.md\n"
      "Example: cranemap config --config site.yaml\n"
      "Example: cranemap config describe mapper.voxel_m");
  command->add_option("ACTION", options->action, "show, changed, describe or reference")
      ->check(CLI::IsMember({"show", "changed", "describe", "reference"}))
      ->capture_default_str();
  command->add_option("KEY", options->key, "A key or a section, such as mapper; of describe");
  add_site_options(*command, options->site);
  return [options] { return config(*options); };
}

}  // namespace crane
