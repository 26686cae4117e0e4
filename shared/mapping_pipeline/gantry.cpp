// SPDX-License-Identifier: Apache-2.0
#include "mapping_pipeline/gantry.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace crane {
namespace {

PositionLimits limits_of(const MapperConfig& c) {
  PositionLimits limits;
  limits.min_m = c.rangefinder_min_m;
  limits.max_m = c.rangefinder_max_m;
  limits.max_gap = std::chrono::milliseconds(c.max_position_gap_ms);
  limits.largest_speed_mps = c.largest_speed_mps;
  limits.noise_m = c.rangefinder_noise_m;
  return limits;
}

constexpr TimeNs kMs = 1'000'000;

std::optional<Cause> cause_of(Axis axis, PositionTrack::Added added) {
  const bool cart = axis != Axis::kTrolley;
  switch (added) {
    case PositionTrack::Added::kYes:
    case PositionTrack::Added::kOutOfOrder:  // sent again by a player: known already
      return std::nullopt;
    case PositionTrack::Added::kNotFinite:
      return cart ? Cause::kCartNotFinite : Cause::kTrolleyNotFinite;
    case PositionTrack::Added::kOutOfRange:
      return cart ? Cause::kCartOutOfRange : Cause::kTrolleyOutOfRange;
    case PositionTrack::Added::kJump:
      return cart ? Cause::kCartJump : Cause::kTrolleyJump;
    case PositionTrack::Added::kStuck:
      return cart ? Cause::kCartStuck : Cause::kTrolleyStuck;
  }
  return std::nullopt;
}

/// How bad each is: what is worse decides.
int badness(PositionTrack::Lookup known) {
  switch (known) {
    case PositionTrack::Lookup::kFound:
      return 0;
    case PositionTrack::Lookup::kUnconfirmed:
      return 1;
    case PositionTrack::Lookup::kNotYet:
      return 2;
    case PositionTrack::Lookup::kDoubtful:
      return 3;
    case PositionTrack::Lookup::kGap:
      return 4;
  }
  return 4;
}

}  // namespace

Gantry::Gantry(const MapperConfig& c)
    : devices_{Device{PositionTrack(limits_of(c)), c.cart_latency_ms * kMs,
                      double(c.cart_direction), c.cart_offset_m, std::nullopt},
               Device{PositionTrack(limits_of(c)), c.trolley_latency_ms * kMs,
                      double(c.trolley_direction), c.trolley_offset_m, std::nullopt},
               Device{PositionTrack(limits_of(c)), c.cart_second_latency_ms * kMs,
                      double(c.cart_second_direction), c.cart_second_offset_m, std::nullopt}},
      rail_y_m_(c.rail_y_m),
      rail_span_m_(c.rail_span_m),
      largest_skew_rad_(c.largest_skew_deg * std::numbers::pi / 180) {}

std::optional<Cause> Gantry::add(Axis axis, std::uint64_t stream, TimeNs time, double distance_m) {
  Device& device = of(axis);
  if (device.stream != stream) {  // another recording may use the same times for other places
    device.stream = stream;
    device.track.clear();
  }
  return cause_of(axis, device.track.add(time - device.latency, distance_m));
}

Gantry::Place Gantry::at(TimeNs time) const {
  Place place;
  place.known = PositionTrack::Lookup::kFound;
  std::array<double, 3> at_m{};
  for (std::size_t i = 0; i < used(); ++i) {
    const Device& device = devices_[i];
    double distance_m = 0;
    const PositionTrack::Lookup known = device.track.at(time, distance_m);
    at_m[i] = device.offset_m + device.direction * distance_m;
    if (badness(known) > badness(place.known)) place.known = known;
  }
  place.map_m = {at_m[0], at_m[1]};
  if (rail_span_m_ == 0) return place;
  // The bridge is a straight line from rail to rail; the trolley is somewhere on it.
  const double per_m = (at_m[2] - at_m[0]) / rail_span_m_;
  place.map_m.x() += per_m * (at_m[1] - rail_y_m_);
  place.skew_rad = -std::atan(per_m);
  if (std::abs(place.skew_rad) > largest_skew_rad_ &&
      badness(place.known) < badness(PositionTrack::Lookup::kDoubtful) &&
      place.known != PositionTrack::Lookup::kNotYet)
    place.known = PositionTrack::Lookup::kDoubtful;
  return place;
}

void Gantry::trust(TimeNs time) {
  for (Device& device : devices_) device.track.trust(time);
}

}  // namespace crane
