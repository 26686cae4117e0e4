#include <CLI/CLI.hpp>
#include <cstdio>

#include "base/log.hpp"
#include "commands.hpp"
#include "map_codec/octomap_file.hpp"
#include "mapping/map_judge.hpp"
#include "service/exit_code.hpp"

namespace crane {
namespace {

int evaluate(const std::string& map_file, const std::string& truth) {
  const auto fail = [](const Error& error) {
    log_error(error.text());
    return exit_code(error);
  };
  auto octree = read_octomap(map_file);
  if (!octree) return fail(octree.error());
  auto heights = read_height_map(truth + "/height_map.png");
  if (!heights) return fail(heights.error());
  const Judgement j = judge(octree->occupied, octree->voxel_m, *heights);
  std::printf(
      "res=%.3f occupied=%zu free=%zu columns=%zu coverage=%.4f obstacle_columns=%zu "
      "unsafe=%.4f missed=%.4f unmapped_obstacle=%.4f phantom=%.5f err_median_m=%.4f "
      "err_p95_m=%.4f\n",
      j.voxel_m, j.occupied, octree->free_leaves, j.columns, j.coverage, j.obstacle_columns,
      j.unsafe, j.missed, j.unmapped_obstacle, j.phantom, j.error_median_m, j.error_p95_m);
  return kExitOk;
}

}  // namespace

Command add_evaluate_command(CLI::App& app) {
  auto map_file = std::make_shared<std::string>();
  auto truth = std::make_shared<std::string>();
  CLI::App* command =
      app.add_subcommand("evaluate",
                         "Judge any .bt or .ot map against a recording's true heights.\n"
                         "Example: cranemap evaluate OUT/map.bt RECORDING/truth");
  command->add_option("MAP", *map_file, "Map as OctoMap writes it")->required();
  command->add_option("TRUTH", *truth, "Folder with height_map.png and height_map.yaml")
      ->required();
  return [map_file, truth] { return evaluate(*map_file, *truth); };
}

}  // namespace crane
