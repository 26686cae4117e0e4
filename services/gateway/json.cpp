// SPDX-License-Identifier: Apache-2.0
#include "gateway/json.hpp"

#include <algorithm>
#include <cinttypes>
#include <cmath>
#include <cstdio>

#include "service/service_name.hpp"

namespace crane::gateway {
namespace {

Json number(double v) {
  return std::isfinite(v) ? Json(v) : Json(nullptr);
}

std::string hex(std::uint64_t v) {
  char text[17];
  std::snprintf(text, sizeof text, "%016" PRIx64, v);
  return text;
}

double age_s(TimeNs now, TimeNs then) {
  return std::max(0.0, double(now - then) * 1e-9);
}

const char* name_of(client::Verdict v) {
  switch (v) {
    case client::Verdict::kClear:
      return "clear";
    case client::Verdict::kBlocked:
      return "blocked";
    case client::Verdict::kInvalid:
      break;
  }
  return "invalid";
}

const char* name_of(client::Reason r) {
  switch (r) {
    case client::Reason::kNone:
      return "none";
    case client::Reason::kMapInvalid:
      return "map_invalid";
    case client::Reason::kBadQuery:
      return "bad_query";
    case client::Reason::kObstacle:
      return "obstacle";
    case client::Reason::kUnknown:
      return "unknown";
    case client::Reason::kStale:
      return "stale";
    case client::Reason::kZone:
      return "zone";
    case client::Reason::kFewViews:
      return "few_views";
  }
  return "none";
}

const char* name_of(client::Status::Hoist h) {
  switch (h) {
    case client::Status::Hoist::kNotUsed:
      return "not_used";
    case client::Status::Hoist::kKnown:
      return "known";
    case client::Status::Hoist::kLost:
      break;
  }
  return "lost";
}

}  // namespace

std::string text_of(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
}

const char* surface_name(client::Surface surface) {
  switch (surface) {
    case client::Surface::kUnknown:
      return "unknown";
    case client::Surface::kFloor:
      return "floor";
    case client::Surface::kObstacle:
      return "obstacle";
    case client::Surface::kStale:
      break;
  }
  return "stale";
}

Json to_json(const client::Status& s, TimeNs now) {
  return {{"heard", s.heard},
          {"alive", s.alive},
          {"valid", s.valid},
          {"complete", s.complete},
          {"reason", s.reason},
          {"reason_code", s.reason_code},
          {"mapper", hex(s.mapper)},
          {"map_id", hex(s.map_id)},
          {"revision", s.revision},
          {"tiles", s.tiles},
          {"voxel_m", s.voxel_m},
          {"last_frame_age_s",
           s.last_frame_time_ns == 0 ? Json(nullptr) : Json(age_s(now, s.last_frame_time_ns))},
          {"frames",
           {{"integrated", s.frames_integrated},
            {"rejected", s.frames_rejected},
            {"missing", s.frames_missing}}},
          {"hoist", name_of(s.hoist)},
          {"ceiling_m", s.ceiling_m},
          {"forget_s", s.forget_s},
          {"samples_refused", s.samples_refused},
          {"memory_bytes", s.memory_bytes}};
}

Json to_json(const client::Height& h, TimeNs now) {
  const bool known = client::is_known(h.surface);
  const auto if_known = [known](double v) { return known ? number(v) : Json(nullptr); };
  return {{"surface", surface_name(h.surface)},
          {"height_m", if_known(h.height_m)},
          {"spread_m", if_known(h.spread_m)},
          {"lower_bound", known ? Json(h.lower_bound) : Json(nullptr)},
          {"free_to_m", if_known(h.free_to_m)},
          {"views", h.views},
          {"age_s", h.last_observed_ns == 0 ? Json(nullptr) : Json(age_s(now, h.last_observed_ns))},
          {"proven_by_hook_m", h.proven_by_hook ? number(h.proven_m) : Json(nullptr)}};
}

Json to_json(const client::Clearance& c) {
  const bool blocked = c.verdict == client::Verdict::kBlocked;
  return {{"verdict", name_of(c.verdict)},
          {"reason", name_of(c.reason)},
          {"text", c.text},
          {"safe_height_m", number(c.safe_height_m)},
          {"safe_low_m", number(c.safe_low_m)},
          {"safe_high_m", number(c.safe_high_m)},
          {"first_blocking", blocked ? Json{{"x_m", number(c.first_x_m)},
                                            {"y_m", number(c.first_y_m)},
                                            {"z_m", number(c.first_z_m)}}
                                     : Json(nullptr)},
          {"oldest_age_s", c.oldest_age_s < 0 ? Json(nullptr) : number(c.oldest_age_s)},
          {"unknown_fraction", number(c.unknown_fraction)},
          {"columns", c.columns},
          {"slow_down", c.slow_down},
          {"zone", c.zone == 0 ? Json(nullptr) : Json(c.zone)},
          {"map_id", hex(c.map_id)},
          {"revision", c.revision}};
}

Json to_json(const client::Zone& z) {
  Json corners = Json::array();
  for (const auto& c : z.corners) corners.push_back(Json::array({c.x_m, c.y_m}));
  return {
      {"id", z.id},           {"kind", z.kind == client::Zone::Kind::kNoGo ? "no_go" : "slow_down"},
      {"active", z.active},   {"switchable", z.switchable},
      {"z_min_m", z.z_min_m}, {"z_max_m", z.z_max_m},
      {"name", z.name},       {"corners", std::move(corners)}};
}

Json to_json(const v1::ServiceStatus& s, TimeNs now) {
  static constexpr const char* kWords[] = {"ok", "degraded", "failed"};
  Json dropped = Json::array();
  for (const v1::DropCount& d : s.dropped())
    dropped.push_back({{"cause", d.cause().c_str()}, {"count", d.count()}});
  Json stages = Json::array();
  for (const v1::StageTime& t : s.stages())
    stages.push_back({{"stage", t.stage().c_str()},
                      {"count", t.count()},
                      {"p50_ms", number(t.p50_ms())},
                      {"p99_ms", number(t.p99_ms())},
                      {"max_ms", number(t.max_ms())}});
  Json figures = Json::array();
  for (const v1::StatusFigure& f : s.figures())
    figures.push_back(
        {{"name", f.name().c_str()}, {"value", number(f.value())}, {"sigma", number(f.sigma())}});
  return {{"service", service_name(s.service())},
          {"status", kWords[std::min<std::uint32_t>(s.status(), v1::STATUS_FAILED)]},
          {"message", s.message().c_str()},
          {"age_s", age_s(now, s.time_ns())},
          {"received", s.received()},
          {"published", s.published()},
          {"finished", s.finished() == 1},
          {"cpu_s", number(s.cpu_seconds())},
          {"memory_bytes", s.memory_bytes()},
          {"version", s.version().c_str()},
          {"dropped", std::move(dropped)},
          {"stages", std::move(stages)},
          {"figures", std::move(figures)}};
}

Json to_json(const v1::HoistState& h, TimeNs now) {
  return {{"hook_height_m", h.hook_height_m()},
          {"sling_m", h.sling_m()},
          {"load_size_m", Json::array({h.load_size_x_m(), h.load_size_y_m(), h.load_size_z_m()})},
          {"load_yaw_rad", h.load_yaw_rad()},
          {"sway_m", Json::array({h.sway_x_m(), h.sway_y_m()})},
          {"ok", h.status() == v1::STATUS_OK},
          {"age_s", age_s(now, h.time_ns())}};
}

}  // namespace crane::gateway
