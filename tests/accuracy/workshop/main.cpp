// SPDX-License-Identifier: Apache-2.0
// All scenes of shared/sim/scenes/workshop against their bounds. usage: tests/accuracy/workshop/run

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "cranemap/judgement_picture.hpp"
#include "temp_folder.hpp"
#include "workshop.hpp"

namespace crane::accuracy {
namespace {

namespace fs = std::filesystem;

struct Options {
  std::string folder = "out/workshop";
  std::vector<std::string> only;
  std::string recordings;  ///< instead of the scenes: a folder of such
  WorkshopOptions workshop;
};

/// `known`: why the scene is listed as short, or nullptr.
std::string row(const WorkshopResult& r, const char* known) {
  const Judgement& j = r.outcome.judgement;
  const CellCounts& c = r.outcome.cells.all;
  const ClearanceTrial& q = r.outcome.clearance;
  char text[400];
  std::snprintf(text, sizeof text,
                "| %s | %zu/%zu | %.3f | %.4f | %.4f | %.3f | %.3f | %.3f | %.3f | %.3f | %zu | "
                "%zu | %.0f | %.0f | ",
                r.scene.c_str(), r.outcome.frames, r.recorded, j.coverage, j.unsafe, j.phantom,
                c.share(c.found), c.share(c.unknown), c.share(c.low), c.share(c.cleared),
                c.share(c.hollow), q.clear, q.wrong_clear, r.outcome.cloud_ms, r.outcome.update_ms);
  std::string out = text;
  for (const std::string& what : r.short_of) out += (&what == r.short_of.data() ? "" : "; ") + what;
  if (r.short_of.empty()) out += known != nullptr ? "holds, and is listed as short" : "holds";
  if (!r.short_of.empty() && known != nullptr) out += std::string(" (known: ") + known + ")";
  return out + " |\n";
}

constexpr const char* kHead =
    "| scene | frames used | coverage | unsafe | phantom | found | unknown | low | cleared | "
    "hollow "
    "| CLEAR | wrong CLEAR | match [ms] | integrate [ms] | bounds "
    "|\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";

Result<void> draw(const WorkshopResult& r, const std::string& folder,
                  const std::string& recording) {
  Evaluation e{r.outcome.judgement, r.outcome.cells, r.outcome.clearance};
  if (auto drawn = draw_judgement(folder + "/" + r.scene + ".png", r.truth, e, r.scene); !drawn)
    return drawn;
  // What the camera saw last, beside it.
  std::vector<fs::path> images;
  for (const auto& image : fs::directory_iterator(recording + "/cam0/data"))
    images.push_back(image.path());
  const fs::path last = *std::max_element(images.begin(), images.end());
  std::error_code ignored;
  fs::copy_file(last, folder + "/" + r.scene + "_image" + last.extension().string(),
                fs::copy_options::overwrite_existing, ignored);
  return {};
}

/// Scene files, or folders of recordings.
std::vector<fs::path> inputs(const Options& options) {
  if (options.recordings.empty()) return workshop_scenes(options.workshop.quick);
  std::vector<fs::path> out;
  for (const auto& entry : fs::directory_iterator(options.recordings))
    if (fs::exists(entry.path() / "truth")) out.push_back(entry.path());
  std::sort(out.begin(), out.end());
  return out;
}

/// Exit code: 0, 1 when a scene that is not listed falls short, 3 when one cannot be run.
int run(const Options& options) {
  std::error_code ignored;
  fs::create_directories(options.folder, ignored);
  std::ofstream table(options.folder + "/table.md");
  table << "# Scenes of a workshop against their bounds\n"
        << (options.workshop.quick ? "Small versions. " : "") << "Voxel "
        << options.workshop.voxel_m
        << " m. Figures: shared/evaluation/README.md; bounds: in each scene.\n\n"
        << kHead;
  std::printf("%s", kHead);
  std::size_t wrong = 0, clear = 0, surprising = 0, known = 0, scenes = 0;
  double seconds = 0;
  for (const fs::path& file : inputs(options)) {
    const bool made = options.recordings.empty();
    const std::string name = made ? file.stem() : file.filename();
    if (!options.only.empty() &&
        std::find(options.only.begin(), options.only.end(), name) == options.only.end())
      continue;
    const test::TempFolder folder;
    const std::string recording = made ? folder / "recording" : file.string();
    auto result = made ? run_workshop_scene(file, recording, options.workshop)
                       : run_workshop_recording(file, options.workshop);
    if (!result) {
      std::fprintf(stderr, "%s: %s\n", name.c_str(), result.error().text().c_str());
      return 3;
    }
    const char* known_why = made ? known_short(name) : nullptr;
    const std::string line = row(*result, known_why);
    std::printf("%s", line.c_str());
    std::fflush(stdout);
    table << line << std::flush;
    if (auto drawn = draw(*result, options.folder, recording); !drawn) {
      std::fprintf(stderr, "%s\n", drawn.error().text().c_str());
      return 3;
    }
    ++scenes;
    wrong += result->outcome.clearance.wrong_clear;
    clear += result->outcome.clearance.clear;
    seconds += result->render_s + result->map_s;
    if (result->short_of.empty()) continue;
    ++(known_why != nullptr ? known : surprising);
  }
  char sum[300];
  std::snprintf(sum, sizeof sum,
                "\n%zu scenes in %.0f s: %zu short of a bound and not listed, %zu listed as short. "
                "%zu queries answered CLEAR, %zu of them wrong.\n",
                scenes, seconds, surprising, known, clear, wrong);
  std::printf("%s", sum);
  table << sum;
  return surprising > 0 ? 1 : 0;
}

}  // namespace
}  // namespace crane::accuracy

int main(int argc, char** argv) {
  CLI::App app{
      "Renders the scenes of shared/sim/scenes/workshop, maps and judges them, compares with "
      "their\n"
      "bounds. Writes table.md, a picture of what is wrong where, and the last image of each."};
  crane::accuracy::Options options;
  app.add_option("--out", options.folder, "Folder of table and pictures")->capture_default_str();
  app.add_option("--scene", options.only, "Only this one; repeatable");
  app.add_option("--recordings", options.recordings,
                 "Instead of the scenes: every recording with truth in this folder")
      ->check(CLI::ExistingDirectory);
  app.add_flag("--quick", options.workshop.quick, "Small versions, of scenes that have one");
  app.add_option("--queries", options.workshop.queries, "Random clearance queries a scene")
      ->capture_default_str();
  app.add_option("--voxel", options.workshop.voxel_m, "Voxel edge [m]")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  return crane::accuracy::run(options);
}
