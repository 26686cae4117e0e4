// SPDX-License-Identifier: Apache-2.0
#include "run_report.hpp"

#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "base/utf8.hpp"
#include "bounds.h"
#include "service/service_name.hpp"

namespace crane {
namespace {

std::string hex(std::uint64_t v) {
  char text[20];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(v));
  return text;
}

}  // namespace

Result<void> write_json(const std::string& path, const RunReport& r) {
  nlohmann::ordered_json j;
  j["cranemap"] = {{"version", CRANEMAP_VERSION}, {"build_type", CRANEMAP_BUILD_TYPE}};
  j["run"] = {{"recording", with_bytes_escaped(r.recording)},
              {"method", r.method},
              {"rate", r.rate},
              {"network", r.network},
              {"wall_s", r.wall_s},
              {"cores", std::thread::hardware_concurrency()}};
  j["frames"] = {{"recorded", r.frames},
                 {"integrated", r.map.frames_integrated},
                 {"rejected", r.map.frames_rejected},
                 {"missing", r.map.frames_missing},
                 {"per_second", r.wall_s > 0 ? double(r.map.frames_integrated) / r.wall_s : 0}};
  j["map"] = {{"id", hex(r.map.map_id)},
              {"revision", r.map.revision},
              {"voxel_m", r.map.voxel_m},
              {"tiles", r.map.tiles},
              {"occupied_voxels", r.voxels.occupied},
              {"free_voxels", r.voxels.free},
              {"reason_code", r.map.reason_code},
              {"reason", r.map.reason},
              {"voxel_digest", hex(r.map.voxel_digest)},
              {"height_digest", hex(r.map.height_digest)},
              {"complete_at_subscriber", r.map.complete}};
  for (const auto& [name, bytes] : r.files) j["files"][name] = bytes;
  for (const auto& [service, s] : r.services) {
    auto& out = j["services"][service_name(service)];
    out["received"] = s.received();
    out["published"] = s.published();
    out["cpu_s"] = s.cpu_seconds();
    out["memory_mib"] = double(s.memory_bytes()) / (1 << 20);
    out["build_type"] = s.build_type().c_str();
    const auto restarted = r.restarts.find(service_name(service));
    out["restarts"] = restarted == r.restarts.end() ? 0 : restarted->second;
    out["dropped"] = nlohmann::ordered_json::object();
    for (const v1::DropCount& d : s.dropped()) out["dropped"][d.cause().c_str()] = d.count();
    for (const v1::StageTime& t : s.stages())
      out["stages_ms"][t.stage().c_str()] = {
          {"count", t.count()}, {"p50", t.p50_ms()}, {"p99", t.p99_ms()}, {"max", t.max_ms()}};
  }
  for (const ObstacleHeight& h : r.heights)
    j["heights"].push_back({{"name", h.name},
                            {"true_m", h.true_m},
                            {"measured_m", h.measured_m},
                            {"lower_bound", h.lower_bound},
                            {"error_percent", h.columns > 0 ? h.error_percent() : 100},
                            {"columns", h.columns}});
  if (r.judged)
    j["judgement"] = {{"coverage", r.judgement.columns.coverage},
                      {"unsafe", r.judgement.columns.unsafe},
                      {"missed", r.judgement.columns.missed},
                      {"unmapped_obstacle", r.judgement.columns.unmapped_obstacle},
                      {"phantom", r.judgement.columns.phantom},
                      {"error_median_m", r.judgement.columns.error_median_m},
                      {"error_p95_m", r.judgement.columns.error_p95_m}};
  if (r.judged) {
    const CellCounts& cells = r.judgement.cells.all;
    j["judgement"]["cells"] = {{"solid", cells.solid},
                               {"found", cells.share(cells.found)},
                               {"unknown", cells.share(cells.unknown)},
                               {"low", cells.share(cells.low)},
                               {"cleared", cells.share(cells.cleared)},
                               {"hollow", cells.share(cells.hollow)}};
    j["judgement"]["clearance"] = {{"queries", r.judgement.clearance.queries},
                                   {"clear", r.judgement.clearance.clear},
                                   {"wrong_clear", r.judgement.clearance.wrong_clear}};
  }
  std::ofstream file(path);
  // Names from the network or a truth file may be any bytes too.
  file << j.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) << "\n";
  file.close();
  if (!file)
    return Error{ErrorCode::kResource, path, "cannot be written",
                 "check permissions and free space"};
  return {};
}

void print(const RunReport& r) {
  std::printf("\nframes      %zu %s, %llu in the map, %llu rejected, %llu missing (%.1f s)\n",
              r.frames, r.verb.c_str(), static_cast<unsigned long long>(r.map.frames_integrated),
              static_cast<unsigned long long>(r.map.frames_rejected),
              static_cast<unsigned long long>(r.map.frames_missing), r.wall_s);
  std::printf(
      "map         %u tiles, %llu voxels occupied, %llu free, voxel %.3f m, revision %llu\n",
      r.map.tiles, static_cast<unsigned long long>(r.voxels.occupied),
      static_cast<unsigned long long>(r.voxels.free), r.map.voxel_m,
      static_cast<unsigned long long>(r.map.revision));
  for (const auto& [service, s] : r.services) {
    for (const v1::DropCount& d : s.dropped())
      std::printf("not used    %-11s %llu x %s\n", service_name(service),
                  static_cast<unsigned long long>(d.count()), d.cause().c_str());
    const auto restarted = r.restarts.find(service_name(service));
    if (restarted != r.restarts.end())
      std::printf("restarted   %-11s %d x\n", service_name(service), restarted->second);
  }
  std::printf("\n%-12s %-28s %8s %9s %9s %9s\n", "service", "stage", "count", "p50 ms", "p99 ms",
              "max ms");
  for (const auto& [service, s] : r.services)
    for (const v1::StageTime& t : s.stages())
      std::printf("%-12s %-28s %8llu %9.2f %9.2f %9.2f\n", service_name(service), t.stage().c_str(),
                  static_cast<unsigned long long>(t.count()), t.p50_ms(), t.p99_ms(), t.max_ms());
  if (!r.heights.empty()) {
    std::printf("\n%-16s %8s %10s %9s\n", "obstacle", "true m", "measured m", "error %");
    for (const ObstacleHeight& h : r.heights) {
      if (h.columns == 0)
        std::printf("%-16s %8.3f %10s\n", h.name.c_str(), h.true_m, "unknown");
      else
        std::printf("%-16s %8.3f %2s%8.4f %9.2f%s\n", h.name.c_str(), h.true_m,
                    h.lower_bound ? ">=" : "", h.measured_m, h.error_percent(),
                    h.lower_bound ? "  may be higher" : "");
    }
  }
  if (r.judged)
    std::printf(
        "\nagainst the truth: coverage %.4f, unsafe %.4f, missed %.4f, unmapped obstacle %.4f, "
        "phantom %.5f\n",
        r.judgement.columns.coverage, r.judgement.columns.unsafe, r.judgement.columns.missed,
        r.judgement.columns.unmapped_obstacle, r.judgement.columns.phantom);
  if (r.judged)
    std::printf("%s%s", cell_report(r.judgement.cells).c_str(),
                clearance_report(r.judgement.clearance).c_str());
}

}  // namespace crane
