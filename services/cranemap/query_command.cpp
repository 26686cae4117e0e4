// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <sstream>

#include "base/log.hpp"
#include "commands.hpp"
#include "crane/client/map.hpp"
#include "service/client_options.hpp"
#include "service/run_service.hpp"
#include "site_options.hpp"

namespace crane {
namespace {

using namespace std::chrono_literals;

constexpr int kExitBlocked = 1, kExitNoAnswer = 4;

struct Options {
  SiteOptions site;
  std::vector<double> at, load = {0, 0, 0}, margin = {0.2, 0.2};
  std::vector<std::string> path;
  double above_m = client::kToRopeTop, sway_m = 0, braking_m = 0, max_age_s = 0;
  std::uint32_t min_views = 1;
};

/// "x,y,z" or "x,y,z,degrees". Error: Configuration.
Result<client::Pose> read_pose(const std::string& text) {
  std::vector<double> v;
  std::istringstream in(text);
  for (std::string part; std::getline(in, part, ',');) {
    char* end = nullptr;
    v.push_back(std::strtod(part.c_str(), &end));
    if (part.empty() || *end != '\0') v.clear(), in.setstate(std::ios::failbit);
  }
  if (v.size() != 3 && v.size() != 4)
    return Error{ErrorCode::kConfiguration, "--path " + text, "is no pose",
                 "write x,y,z or x,y,z,degrees: metres in the map frame"};
  return client::Pose{v[0], v[1], v[2], v.size() == 4 ? v[3] * std::numbers::pi / 180 : 0};
}

int ask_height(const client::Map& map, const Options& options) {
  const double x = options.at[0];
  const double y = options.at[1];
  const client::Height h = map.height(x, y);
  if (!client::is_known(h.surface)) {
    std::printf("height at (%.2f, %.2f): %s, so not free\n", x, y,
                h.surface == client::Surface::kStale ? "not seen for too long" : "unknown");
    if (h.proven_by_hook) std::printf("hook or load have been there down to %.2f m\n", h.proven_m);
    return kExitBlocked;
  }
  std::printf("height at (%.2f, %.2f): %s%.4f m, spread %.4f m (%s)\n", x, y,
              h.lower_bound ? "at least " : "", h.height_m, h.spread_m,
              h.surface == client::Surface::kFloor ? "floor" : "obstacle");
  if (h.lower_bound)
    std::printf("LOWER BOUND: the space above it was not seen: it may be higher\n");
  else
    std::printf("known to be free above it up to %.2f m; what is higher was never seen\n",
                h.free_to_m);
  std::printf("seen in %u%s frame%s\n", h.views, h.views >= 32 ? " or more" : "",
              h.views == 1 ? " only" : "s");
  if (h.proven_by_hook) std::printf("hook or load have been there down to %.2f m\n", h.proven_m);
  return h.lower_bound || h.views < options.min_views ? kExitBlocked : kExitOk;
}

int ask_clearance(const client::Map& map, const client::ClearanceQuery& query) {
  const client::Clearance c = map.clearance(query);
  if (c.verdict == client::Verdict::kInvalid) {
    std::printf("NO ANSWER: %s\n", c.text.c_str());
    return c.reason == client::Reason::kBadQuery ? kExitConfiguration : kExitNoAnswer;
  }
  const bool clear = c.verdict == client::Verdict::kClear;
  std::printf("%s%s%s\n", clear ? "CLEAR" : "BLOCKED: ", clear ? "" : "by ", c.text.c_str());
  if (c.slow_down) std::printf("slowly: part of the way is in a slow-down zone\n");
  double asked_m = query.path[0].z_m;
  for (const client::Pose& p : query.path) asked_m = std::max(asked_m, p.z_m);
  if (std::isfinite(c.safe_height_m))
    std::printf("next clear height             %.3f m, clear from %.3f to %.3f m\n",
                c.safe_height_m, c.safe_low_m, c.safe_high_m);
  else
    std::printf("next clear height             none at or above %.3f m\n", asked_m);
  if (c.oldest_age_s < 0)
    std::printf("oldest column                 never seen\n");
  else
    std::printf("oldest column                 %.1f s ago\n", c.oldest_age_s);
  std::printf("unknown                       %.2f %% of %llu columns\n", 100 * c.unknown_fraction,
              static_cast<unsigned long long>(c.columns));
  std::printf("map %016llx revision %llu\n", static_cast<unsigned long long>(c.map_id),
              static_cast<unsigned long long>(c.revision));
  return clear ? kExitOk : kExitBlocked;
}

int query(const Options& options) {
  const auto fail = [](const Error& error) {
    log_error(error.text());
    return exit_code(error);
  };
  auto site = read_site(options.site);
  if (!site) return fail(site.error());
  const SiteConfig& config = *site;
  client::ClearanceQuery clearance;
  for (const std::string& text : options.path) {
    auto pose = read_pose(text);
    if (!pose) return fail(pose.error());
    clearance.path.push_back(*pose);
  }
  if (options.at.empty() == clearance.path.empty())
    return fail(Error{ErrorCode::kConfiguration, "query", "needs --at or --path", "see --help"});
  clearance.load = {options.load[0], options.load[1], options.load[2], options.above_m};
  clearance.margins = {options.margin[0], options.margin[1], options.sway_m, options.braking_m};
  clearance.max_age_s = options.max_age_s;
  clearance.min_views = options.min_views;
  std::string why;
  const auto map = client::Map::join(client_options(config, "dashboard"), why);
  if (!map) return fail(Error{ErrorCode::kResource, "map", why, ""});
  if (!map->wait_until_complete(10s)) {
    const std::string& reason = map->status().reason;
    std::printf("NO ANSWER: no complete map within 10 s%s%s\n", reason.empty() ? "" : ": ",
                reason.c_str());
    return kExitNoAnswer;
  }
  return options.at.empty() ? ask_clearance(*map, clearance) : ask_height(*map, options);
}

}  // namespace

Command add_query_command(CLI::App& app) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand(
      "query",
      "Ask a running map: how high is it there, or may the load go along that path?\n"
      "Example: cranemap query --at 0.75 0.55\n"
      "Example: cranemap query --path 1.45,1.8,0.3 1.95,1.8,0.3 --load 0.3 0.3 0.2 --margin 0.1 "
      "0.1 "
      "--above 0.2\n"
      "Exit: 0 known or clear; 1 unknown, a lower bound, of too few views, or blocked; 2 input, 3 "
      "resource, 4 no answer.");
  command->add_option("--at", options->at, "x y [m]: height of the map there")->expected(2);
  command->add_option("--path", options->path,
                      "Poses x,y,z[,degrees] of the middle of the load's underside");
  command->add_option("--load", options->load, "Size x y z [m]")->expected(3);
  command->add_option("--margin", options->margin, "Horizontal and vertical [m]")
      ->expected(2)
      ->capture_default_str();
  command->add_option("--above", options->above_m,
                      "So much above the load must be free too [m]; without it: up to the rope's "
                      "top, however high, as hook and rope are there");
  command
      ->add_option("--min-views", options->min_views,
                   "Heights that rest on fewer frames do not count (to 32)")
      ->check(CLI::Range(1, 32));
  command->add_option("--sway", options->sway_m, "Added to the horizontal margin [m]");
  command->add_option("--braking", options->braking_m,
                      "Each leg goes on so far beyond its end [m]");
  command->add_option("--max-age", options->max_age_s,
                      "Older columns are unknown [s]; 0 = any age");
  add_site_options(*command, options->site);
  return [options] { return query(*options); };
}

}  // namespace crane
