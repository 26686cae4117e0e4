// SPDX-License-Identifier: Apache-2.0
#include "mapping_pipeline/hoist_tracker.hpp"

#include <algorithm>

#include "mapping/proven_space.hpp"

namespace crane {
namespace {

constexpr TimeNs kOtherTime = 60 * kNsPerSecond;
constexpr std::size_t kKept = 512;       ///< readings
constexpr double kFarthestStep_m = 2.0;  ///< from reading to reading

HoistGeometry hoist_geometry(const HoistConfig& c, double camera_height_m) {
  HoistGeometry g;
  g.offset_m = {c.offset_x_m, c.offset_y_m};
  g.rope_top_m = c.rope_top_m > 0 ? c.rope_top_m : camera_height_m;
  g.rope_radius_m = c.rope_radius_m;
  g.hook_size_m = {c.hook_x_m, c.hook_y_m, c.hook_z_m};
  g.margin_m = c.margin_m;
  g.sway_m = c.sway_m;
  g.largest_load_m = c.largest_load_m;
  g.accuracy_m = c.accuracy_m;
  return g;
}

}  // namespace

HoistTracker::HoistTracker(const HoistConfig& config, double camera_height_m)
    : config_(config), geometry_(hoist_geometry(config, camera_height_m)) {}

bool HoistTracker::add(const HoistReading& reading) {
  if (!used()) return true;
  if (reading.load_size_m.head<2>().maxCoeff() > geometry_.largest_load_m ||
      reading.load_size_m.z() > geometry_.rope_top_m)
    return false;
  if (!readings_.empty() && reading.time <= readings_.back().time) {
    // Sent again by a player; or another recording, with times of its own.
    if (reading.time > readings_.back().time - kOtherTime) return true;
    readings_.clear();
    unproven_.clear();
    last_.reset();
  }
  for (auto* queue : {&readings_, &unproven_}) {
    queue->push_back(reading);
    if (queue->size() > kKept) queue->pop_front();
  }
  return true;
}

bool HoistTracker::reaches(TimeNs exposure) const {
  return !readings_.empty() && readings_.back().time >= exposure;
}

std::deque<HoistReading>::const_iterator HoistTracker::before(TimeNs time) const {
  const auto after = std::upper_bound(readings_.begin(), readings_.end(), time,
                                      [](TimeNs t, const HoistReading& r) { return t < r.time; });
  return after == readings_.begin() ? readings_.end() : std::prev(after);
}

HoistKnown HoistTracker::known_at(TimeNs exposure) const {
  if (!used()) return HoistKnown::kNotUsed;
  const auto last = before(exposure);
  return last != readings_.end() && exposure - last->time <= max_gap() ? HoistKnown::kKnown
                                                                       : HoistKnown::kLost;
}

std::optional<TimeNs> HoistTracker::apart(TimeNs exposure) const {
  if (readings_.empty()) return std::nullopt;
  const auto last = before(exposure);
  const auto next = last == readings_.end() ? readings_.begin() : std::next(last);
  TimeNs nearest = next != readings_.end() ? next->time - exposure : last->time - exposure;
  if (last != readings_.end() && exposure - last->time < std::abs(nearest))
    nearest = last->time - exposure;
  if (std::abs(nearest) <= kOtherTime) return std::nullopt;
  return nearest;
}

Bodies HoistTracker::bodies_at(TimeNs exposure, const Eigen::Vector2d& gantry_m) const {
  switch (known_at(exposure)) {
    case HoistKnown::kNotUsed:
      return {};
    case HoistKnown::kLost:
      return unknown_hoist_bodies(geometry_, gantry_m);
    case HoistKnown::kKnown:
      break;
  }
  const auto last = before(exposure);
  Bodies out = hoist_bodies(geometry_, *last, gantry_m);
  if (const auto next = std::next(last); next != readings_.end()) {
    Bodies more = hoist_bodies(geometry_, *next, gantry_m);
    std::move(more.begin(), more.end(), std::back_inserter(out));
  }
  return out;
}

std::size_t HoistTracker::prove(const Gantry& gantry, OccupancyMap& map) {
  std::size_t proven = 0;
  while (!unproven_.empty()) {
    const HoistReading r = unproven_.front();
    const Gantry::Place place = gantry.at(r.time);
    if (place.known == PositionTrack::Lookup::kNotYet) break;
    unproven_.pop_front();
    if (place.known != PositionTrack::Lookup::kFound) {
      last_.reset();
      continue;
    }
    const Boxes now{r, hook_box(geometry_, r, place.map_m), load_box(geometry_, r, place.map_m)};
    // What jumps was not on a straight way in between.
    const bool steady = last_ && r.time - last_->reading.time <= max_gap() &&
                        (now.hook.centre - last_->hook.centre).norm() < kFarthestStep_m;
    const bool same_load = steady && r.load_size_m == last_->reading.load_size_m &&
                           r.sling_m == last_->reading.sling_m;
    const double a = geometry_.accuracy_m;
    proven += prove_swept(steady ? last_->hook : now.hook, now.hook, a, map);
    if (r.has_load()) proven += prove_swept(same_load ? last_->load : now.load, now.load, a, map);
    last_ = now;
  }
  return proven;
}

void HoistTracker::prove_nothing() {
  unproven_.clear();
  last_.reset();
}

}  // namespace crane
