// SPDX-License-Identifier: Apache-2.0
#include "workshop.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>

#include "base/stage_times.hpp"

namespace crane::accuracy {
namespace {

namespace fs = std::filesystem;

constexpr const char* kCame = "a place that was seen through before, for a frame";
constexpr const char* kNear =
    "near the camera edges are mapped lower, and ghosts stand beside them";
constexpr const char* kThin = "of the thinnest a few cells; along the baseline 5 cm stay unknown";
constexpr const char* kRepeats = "the rim of the pattern beside obstacles is mapped off its height";
constexpr const char* kNoise = "noise that matches noise";
constexpr const char* kLow = "a low thing is pulled towards the floor's height at its ends";
constexpr const char* kFewCells = "several depths of the pattern fit all places on this way";
constexpr const char* kRim = "the rim of the pattern is seen from too few places";
constexpr const char* kThrough = "what is seen through or in it frees it";

struct Short {
  const char* scene;
  const char* why;
};
/// Scenes that fall short of a bound today, at full size or small. Figures: the table of ./run.
constexpr Short kKnownShort[] = {
    {"beams_near", kNear},
    {"drive_bricks", kFewCells},
    {"drive_bricks_uneven", kRim},
    {"drive_checker", kFewCells},
    {"drive_checker_uneven", kRim},
    {"drive_grating", kFewCells},
    {"drive_stripes", kFewCells},
    {"floor_bricks", kRepeats},
    {"floor_grating", kRepeats},
    {"floor_low_texture", kNoise},
    {"forks", kLow},
    {"glass", kThrough},
    {"ladder", kThin},
    {"person_walking", kCame},
    {"pipes_level_across", kThin},
    {"pipes_level_along", kThin},
    {"wires", kThin},
};

std::map<std::string, double> shares_of(const CellCounts& c) {
  return {{"found", c.share(c.found)},
          {"unknown", c.share(c.unknown)},
          {"low", c.share(c.low)},
          {"cleared", c.share(c.cleared)},
          {"hollow", c.share(c.hollow)}};
}

double height_error_m(const std::vector<ObstacleHeight>& heights, const std::string& name) {
  double worst = 0;  // unknown is no error
  for (const ObstacleHeight& h : heights)
    if (h.columns > 0 && h.level() && (name.empty() || h.name == name))
      worst = std::max(worst, std::abs(h.measured_m - h.true_m));
  return worst;
}

/// Everything that a bound may speak of; of one obstacle when `name` is given.
std::map<std::string, double> quantities(const WorkshopResult& r, const std::string& name) {
  const CellJudgement& cells = r.outcome.cells;
  std::map<std::string, double> out;
  if (name.empty()) {
    out = shares_of(cells.all);
    out["coverage"] = r.outcome.judgement.coverage;
    out["unsafe"] = r.outcome.judgement.unsafe;
    out["phantom"] = r.outcome.judgement.phantom;
    out["wrong_clear"] = double(r.outcome.clearance.wrong_clear);
    out["frames_used"] = double(r.outcome.frames);
  } else {
    for (const CellCounts& o : cells.obstacles)
      if (o.name == name && o.solid > 0) out = shares_of(o);
    if (out.empty()) return out;
  }
  out["height_error_m"] = height_error_m(r.heights, name);
  return out;
}

std::string number(double v) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", v);
  return text;
}

void compare(const SceneBound::Limits& limits, WorkshopResult& r) {
  const std::map<std::string, double> is = quantities(r, limits.obstacle);
  const std::string of = limits.obstacle.empty() ? "" : limits.obstacle + ": ";
  const auto check = [&](const std::map<std::string, double>& bounds, bool least) {
    for (const auto& [quantity, bound] : bounds) {
      const auto at = is.find(quantity);
      if (at == is.end())
        r.short_of.push_back(of + quantity + " was not judged");
      else if (least ? !(at->second >= bound) : !(at->second <= bound))
        r.short_of.push_back(of + quantity + " " + number(at->second) + (least ? " < " : " > ") +
                             number(bound));
    }
  };
  check(limits.least, true);
  check(limits.most, false);
}

Result<WorkshopResult> map_and_judge(const Recording& recording, const Scene& scene,
                                     const WorkshopOptions& options) {
  WorkshopResult r;
  r.scene = scene.name;
  r.recorded = recording.frames().size();
  const Stopwatch mapping;
  Method method = cranemap_method(options.voxel_m);
  method.queries = options.queries;
  method.free_precision = false;
  auto outcome = run_trial(recording, scene, method);
  if (!outcome) return outcome.error();
  r.outcome = *std::move(outcome);
  auto truth = read_truth(recording.folder() + "/truth");
  if (!truth) return truth.error();
  r.truth = *std::move(truth);
  r.heights = measure(r.outcome.grid, r.truth.obstacles);
  r.map_s = mapping.ms() * 1e-3;
  for (const SceneBound::Limits& limits : scene.bound.limits) compare(limits, r);
  return r;
}

}  // namespace

const char* known_short(const std::string& scene) {
  const auto* at = std::find_if(std::begin(kKnownShort), std::end(kKnownShort),
                                [&](const Short& s) { return scene == s.scene; });
  return at == std::end(kKnownShort) ? nullptr : at->why;
}

std::vector<fs::path> workshop_scenes(bool quick) {
  std::vector<fs::path> out;
  for (const auto& entry : fs::directory_iterator(CRANEMAP_WORKSHOP_SCENES)) {
    if (entry.path().extension() != ".yaml") continue;
    const auto scene = read_scene(entry.path());
    // One that cannot be read is run, so that somebody hears of it.
    if (!quick || !scene || scene->quick.width > 0) out.push_back(entry.path());
  }
  std::sort(out.begin(), out.end());
  return out;
}

Result<WorkshopResult> run_workshop_scene(const fs::path& file, const std::string& folder,
                                          const WorkshopOptions& options) {
  auto scene = read_scene(file);
  if (!scene) return scene.error();
  if (options.quick && scene->quick.width > 0) scene = make_quick(*std::move(scene));
  const Stopwatch rendering;
  auto recording = render(*scene, folder);
  if (!recording) return recording.error();
  const double render_s = rendering.ms() * 1e-3;
  auto result = map_and_judge(*recording, *scene, options);
  if (result) result->render_s = render_s;
  return result;
}

Result<WorkshopResult> run_workshop_recording(const fs::path& folder,
                                              const WorkshopOptions& options) {
  auto recording = Recording::open(folder);
  if (!recording) return recording.error();
  Scene scene;
  scene.name = folder.filename();
  scene.bound.limits.resize(1);
  scene.bound.limits[0].most = {
      {"cleared", 0}, {"hollow", 0}, {"wrong_clear", 0}, {"low", 0.01}, {"phantom", 0.005}};
  return map_and_judge(*recording, scene, options);
}

}  // namespace crane::accuracy
