// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cstdio>
#include <numbers>
#include <string>

#include "watchdog/watchdog.hpp"

namespace crane {
namespace {

struct Words {
  const char* name;
  ShownUnit unit;
  const char* what;  ///< with the figure behind it
  const char* advice;
};

constexpr ShownUnit kNoUnit{"", 1}, kMetres{"m", 1}, kShare{"%", 100}, kPixels{"px", 1},
    kDegrees{"deg", 180 / std::numbers::pi}, kMilliseconds{"ms", 1000};

/// As Suspect counts.
constexpr std::array<Words, 21> kWords{{
    {"none", kNoUnit, "all agrees", ""},
    {"height", kMetres, "the floor lies off by",
     "correct the camera's height (rig.yaml), or its focal length"},
    {"toe_in", kShare, "the cameras' toe-in is wrong: depths are off by",
     "calibrate the pair again"},
    {"baseline", kShare, "the pair's baseline or principal point is wrong: depths are off by",
     "calibrate the pair again"},
    {"depth", kShare, "toe-in or baseline is wrong: depths are off by", "calibrate the pair again"},
    {"depth_or_height", kMetres, "the floor lies off by",
     "it is one of camera height, toe-in and baseline: drive, and it can be told"},
    {"tilt", kDegrees, "the camera is tilted otherwise than rig.yaml says, by",
     "measure its mount again"},
    {"roll", kDegrees, "the right camera is rolled against the left one by",
     "calibrate the pair again"},
    {"row_offset", kPixels, "rows of the right camera lie off by", "calibrate the pair again"},
    {"row_slope", kShare, "the images' heights differ by", "calibrate the pair again"},
    {"cart_scale", kShare, "images go farther than the cart's readings by",
     "check the cart's rangefinder: unit, reflector, line of sight"},
    {"trolley_scale", kShare, "images go farther than the trolley's readings by",
     "check the trolley's rangefinder: unit, reflector, line of sight"},
    {"cart_direction", kNoUnit, "the cart's readings count the other way: scale off by",
     "set mapper.cart_direction"},
    {"trolley_direction", kNoUnit, "the trolley's readings count the other way: scale off by",
     "set mapper.trolley_direction"},
    {"cart_delay", kMilliseconds, "the cart's readings come late by", "set mapper.cart_latency_ms"},
    {"trolley_delay", kMilliseconds, "the trolley's readings come late by",
     "set mapper.trolley_latency_ms"},
    {"camera_delay", kMilliseconds, "all readings come late against the camera by",
     "check the hosts' clocks, or set both latencies"},
    {"cart_jump", kMetres, "the cart's readings jumped by", "check its reflector and beam"},
    {"trolley_jump", kMetres, "the trolley's readings jumped by", "check its reflector and beam"},
    {"turned", kDegrees, "the image is turned against the rails by",
     "the bridge is skew, or the mount's yaw is wrong"},
    {"motion", kMetres, "images and positions disagree by", "check rangefinders and clocks"},
}};

}  // namespace

const char* name_of(Suspect suspect) {
  return kWords[static_cast<std::size_t>(suspect)].name;
}

bool is_of_positions(Suspect suspect) {
  return suspect >= Suspect::kCartScale;
}

ShownUnit unit_of(Suspect suspect) {
  return kWords[static_cast<std::size_t>(suspect)].unit;
}

std::vector<WatchFigure> figures_of(const Watchdog& w) {
  const FloorWatch::Finding& f = w.floor();
  const RowError& r = w.rows();
  const AxisFit& cart = w.motion()[0];
  const AxisFit& trolley = w.motion()[1];
  std::vector<WatchFigure> all = {{"watch_floor_m", f.height_m},
                                  {"watch_floor_bend_m", f.bend_m},
                                  {"watch_tilt_x_rad", f.slope_x},
                                  {"watch_tilt_y_rad", f.slope_y},
                                  {"watch_cart_scale", cart.scale},
                                  {"watch_cart_turn_rad", cart.turn},
                                  {"watch_cart_delay_s", cart.delay_s},
                                  {"watch_trolley_scale", trolley.scale},
                                  {"watch_trolley_turn_rad", trolley.turn},
                                  {"watch_trolley_delay_s", trolley.delay_s}};
  if (r.patches > 0) {
    all.push_back({"watch_row_offset_px", {r.offset_px, r.offset_sigma_px}});
    all.push_back({"watch_row_roll_rad", {r.roll_rad, r.roll_sigma_rad}});
    all.push_back({"watch_row_slope", {r.slope, r.slope_sigma}});
  }
  std::erase_if(all, [](const WatchFigure& figure) { return !figure.figure.known(); });
  return all;
}

std::string text_of(const Misfit& m) {
  const Words& w = kWords[static_cast<std::size_t>(m.suspect)];
  if (m.suspect == Suspect::kNone) return w.what;
  char text[200];
  std::snprintf(text, sizeof text, "%s: %s %.3g +- %.1g %s; %s", w.name, w.what,
                m.figure.value * w.unit.factor, m.figure.sigma * w.unit.factor, w.unit.unit,
                w.advice);
  return text;
}

}  // namespace crane
