// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>

#include "base/log.hpp"
#include "base/read_file.hpp"
#include "child_output.hpp"
#include "commands.hpp"
#include "commission_items.hpp"
#include "output.hpp"
#include "service/run_service.hpp"

namespace crane {
namespace {

namespace fs = std::filesystem;

struct Options {
  std::string out, config, answers;
  std::vector<std::string> again;
};

struct Step {
  const char* name;
  Result<void> (*look)(const CommissionSite&, CommissionItem&);
  bool needed;  ///< by those that follow
};
constexpr Step kSteps[] = {
    {"sensors", commission_sensors, true},
    {"images", commission_images, true},
    {"calibration", commission_calibration, true},
    {"drive", commission_drive, true},
    {"map", commission_map, false},
    {"hoist", commission_hoist, false},
    {"zones", commission_zones, false},
};

/// The site's configuration is there from the first time on.
Result<SiteConfig> take_config(const Options& o, const CommissionSite& site) {
  std::error_code failed;
  fs::create_directories(site.work(), failed);
  if (failed)
    return Error{ErrorCode::kResource, site.work(), "cannot be made: " + failed.message(),
                 "check permissions"};
  const auto there = is_there(site.site_yaml());
  if (!there) return there.error();
  if (!o.config.empty() && !*there) {
    if (const auto good = read_site_config(o.config); !good) return good.error();
    fs::copy_file(o.config, site.site_yaml(), failed);
    if (failed)
      return Error{ErrorCode::kResource, site.site_yaml(), "cannot be written: " + failed.message(),
                   "check permissions"};
  } else if (!*there) {
    return Error{ErrorCode::kConfiguration, "--config", "is needed the first time",
                 "a site.yaml that says how camera and rangefinders are connected: "
                 "docs/commissioning.md has one"};
  } else if (!o.config.empty()) {
    log_warning("--config is left out: " + site.site_yaml() +
                " is there, and may hold what was measured; edit that");
  }
  return read_site_config(site.site_yaml());
}

void print(const CommissionItem& item) {
  static constexpr const char* kWords[] = {"good", "note", "BAD "};
  for (const Finding& f : item.findings) {
    std::printf("  %s  %-14s %s\n", kWords[static_cast<int>(f.verdict)], f.what.c_str(),
                f.text.c_str());
    if (!f.advice.empty()) std::printf("%22s-> %s\n", "", f.advice.c_str());
  }
  std::printf("  %s\n", item.state == CommissionItem::State::kPassed ? "PASSED" : "FAILED");
  flush_output();
}

/// One item until it passes, or is left for later.
Result<void> go_through(const Step& step, const CommissionSite& site, CommissionBook& book,
                        int crane) {
  CommissionItem& item = book.item(step.name);
  do {
    item.findings.clear();
    item.pictures.clear();
    item.state = CommissionItem::State::kOpen;
    std::printf("\n== %s\n", item.title.c_str());
    const auto looked = step.look(site, item);
    if (stop_requested()) return broken_off();
    if (!looked && is_broken_off(looked.error())) return looked;
    if (!looked) item.bad(looked.error().where, looked.error().what, looked.error().todo);
    CommissionBook::close(item);
    print(item);
    if (auto saved = book.save(); !saved) return saved;
    if (auto written = write_commission_report(book, site.work(), crane); !written) return written;
  } while (item.state == CommissionItem::State::kFailed && site.answers->again());
  return {};
}

Result<int> commission(const Options& o) {
  CommissionSite site{fs::path(o.out).lexically_normal(), nullptr};
  const auto config = take_config(o, site);
  if (!config) return config.error();
  auto answers = Answers::open(o.answers, site.work() + "/answers.yaml");
  if (!answers) return answers.error();
  site.answers = &*answers;
  auto book = CommissionBook::open(site.work());
  if (!book) return book.error();
  for (const std::string& name : o.again) book->item(name).state = CommissionItem::State::kOpen;
  bool stopped = false;
  for (const Step& step : kSteps) {
    CommissionItem& item = book->item(step.name);
    if (item.state == CommissionItem::State::kPassed || stopped) continue;
    if (auto gone = go_through(step, site, *book, config->crane); !gone) return gone.error();
    stopped = step.needed && item.state != CommissionItem::State::kPassed;
  }
  static constexpr const char* kStates[] = {"not done", "PASSED", "FAILED"};
  std::printf("\n");
  for (const CommissionItem& item : book->items())
    std::printf("%-9s %s\n", kStates[static_cast<int>(item.state)], item.title.c_str());
  std::printf("report: %s/report.html\n", site.work().c_str());
  if (book->all_passed()) {
    std::printf("the site is in %s: cranemap serve --site %s\n", site.folder.c_str(),
                site.folder.c_str());
    return static_cast<int>(kExitOk);
  }
  std::printf("correct what is BAD; the same command goes on where it was\n");
  return static_cast<int>(kExitConfiguration);
}

}  // namespace

Command add_commission_command(CLI::App& app) {
  auto options = std::make_shared<Options>();
  Options& o = *options;
  CLI::App* command = app.add_subcommand(
      "commission",
      "Leads through the commissioning of a crane: sensors, images, calibration, drive, test map,\n"
      "hoist, zones. Can be broken off and gone on with. Ends with passed or failed for each, a\n"
      "report to print, and the folder that 'cranemap serve --site' takes.\n"
      "Example: cranemap commission --out deploy/sites/crane-1 --config devices.yaml");
  command->add_option("--out", o.out, "Folder of the site; new, or one that is gone on with")
      ->required();
  command->add_option("--config", o.config, "Site configuration (YAML) to begin with")
      ->check(CLI::ExistingFile);
  command
      ->add_option("--answers", o.answers,
                   "Answers (YAML: docs/commissioning.md); then nothing is asked")
      ->check(CLI::ExistingFile);
  std::vector<std::string> names;
  for (const Step& step : kSteps) names.emplace_back(step.name);
  command->add_option("--again", o.again, "Items to go through once more")
      ->check(CLI::IsMember(names));
  return [options] {
    const auto code = commission(*options);
    if (code) return *code;
    log_error(code.error().text());
    return static_cast<int>(exit_code(code.error()));
  };
}

}  // namespace crane
