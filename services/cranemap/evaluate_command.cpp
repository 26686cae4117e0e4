// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>

#include "base/log.hpp"
#include "commands.hpp"
#include "evaluation/evaluation.hpp"
#include "judgement_picture.hpp"
#include "map_codec/octomap_file.hpp"
#include "service/exit_code.hpp"

namespace crane {
namespace {

struct Options {
  std::string map_file, truth, picture;
  ClearanceTrialOptions queries;
};

int evaluate(const Options& options) {
  const auto fail = [](const Error& error) {
    log_error(error.text());
    return exit_code(error);
  };
  auto octree = read_octomap(options.map_file);
  if (!octree) return fail(octree.error());
  auto truth = read_truth(options.truth);
  if (!truth) return fail(truth.error());
  auto map = JudgedMap::from_file(*octree, truth->heights);
  if (!map) return fail(map.error());
  const Evaluation e = evaluate(*map, *truth, options.queries);
  const Judgement& j = e.columns;
  std::printf(
      "res=%.3f occupied=%zu free=%zu columns=%zu coverage=%.4f obstacle_columns=%zu "
      "unsafe=%.4f missed=%.4f unmapped_obstacle=%.4f phantom=%.5f err_median_m=%.4f "
      "err_p95_m=%.4f\n",
      j.voxel_m, j.occupied, octree->free.size(), j.columns, j.coverage, j.obstacle_columns,
      j.unsafe, j.missed, j.unmapped_obstacle, j.phantom, j.error_median_m, j.error_p95_m);
  if (j.phantom > 0)
    std::printf("worst phantom: %.2f m too high at x %.2f, y %.2f\n", j.phantom_excess_m,
                j.phantom_x_m, j.phantom_y_m);
  std::printf("%s%s", cell_report(e.cells).c_str(), clearance_report(e.clearance).c_str());
  if (options.picture.empty()) return kExitOk;
  const std::string title = std::filesystem::path(options.map_file).filename();
  if (auto drawn = draw_judgement(options.picture, *truth, e, title); !drawn)
    return fail(drawn.error());
  return kExitOk;
}

}  // namespace

Command add_evaluate_command(CLI::App& app) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand(
      "evaluate",
      "Judge any .bt or .ot map against a recording's true heights: columns, every true surface\n"
      "cell, each obstacle, and what a controller would be told.\n"
      "Example: cranemap evaluate OUT/map.bt RECORDING/truth --picture judged.png");
  command->add_option("MAP", options->map_file, "Map as OctoMap writes it")->required();
  command
      ->add_option("TRUTH", options->truth,
                   "Folder with height_map.png, height_map.yaml and obstacles.yaml")
      ->required();
  command->add_option("--picture", options->picture, "Write a picture (PNG) of where it is wrong");
  command->add_option("--queries", options->queries.queries, "Random clearance queries")
      ->check(CLI::Range(0, 10'000'000))
      ->capture_default_str();
  command
      ->add_option("--margin", options->queries.margin_m,
                   "Of the queries, around the load [m]; one voxel when not given")
      ->check(CLI::Range(0.0, 10.0));
  command->add_option("--seed", options->queries.seed, "Of the queries")->capture_default_str();
  return [options] { return evaluate(*options); };
}

}  // namespace crane
