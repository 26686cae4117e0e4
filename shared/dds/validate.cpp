// SPDX-License-Identifier: Apache-2.0
#include "dds/validate.hpp"

#include <cmath>
#include <initializer_list>
#include <set>
#include <vector>

#include "bounds.h"
#include "dds/service_numbers.hpp"
#include "geometry/simple_polygon.hpp"

namespace crane::dds {
namespace {

bool finite(std::initializer_list<double> values) {
  for (double v : values)
    if (!std::isfinite(v)) return false;
  return true;
}

/// After 1970 and before 2096: what is later overflows when it is added to.
bool is_time(std::int64_t ns) {
  return ns > 0 && ns < 4'000'000'000'000'000'000;
}

bool image_fits(std::uint32_t width, std::uint32_t height) {
  return width > 0 && height > 0 && width <= 65'535 && height <= 65'535 &&
         std::uint64_t(width) * height <= v1::MAX_PIXELS;
}

bool status_known(std::uint32_t status) {
  return status <= v1::STATUS_FAILED;
}

static_assert(v1::MAX_PIXELS == kMaxImagePixels && v1::MAX_IMAGE_BYTES == kMaxImageBytes);
static_assert(v1::ENCODING_MONO8 == static_cast<std::uint32_t>(PixelFormat::kMono8) &&
              v1::ENCODING_BGR8 == static_cast<std::uint32_t>(PixelFormat::kBgr8) &&
              v1::ENCODING_RGB8 == static_cast<std::uint32_t>(PixelFormat::kRgb8) &&
              v1::ENCODING_YUYV == static_cast<std::uint32_t>(PixelFormat::kYuyv) &&
              v1::ENCODING_BAYER_RGGB8 == static_cast<std::uint32_t>(PixelFormat::kBayerRggb8) &&
              v1::ENCODING_BAYER_BGGR8 == static_cast<std::uint32_t>(PixelFormat::kBayerBggr8) &&
              v1::ENCODING_MONO10P == static_cast<std::uint32_t>(PixelFormat::kMono10p) &&
              v1::ENCODING_MONO12P == static_cast<std::uint32_t>(PixelFormat::kMono12p) &&
              v1::ENCODING_BAYER_BGGR10P ==
                  static_cast<std::uint32_t>(PixelFormat::kBayerBggr10p) &&
              v1::ENCODING_BAYER_BGGR12P ==
                  static_cast<std::uint32_t>(PixelFormat::kBayerBggr12p) &&
              v1::ENCODING_JPEG == static_cast<std::uint32_t>(PixelFormat::kJpeg));

/// `whole`: all of it must make sense; else only its id does.
const char* zone_flaw(const v1::Zone& z, bool whole) {
  // What the mapper's configuration could say as well: it is kept as such.
  constexpr std::uint32_t kHighestId = 1'000'000;
  if (z.id() == 0 || z.id() > kHighestId) return "a zone's id is not within 1 .. 1000000";
  if (z.active() > 1 || z.switchable() > 1) return "active or switchable is neither 0 nor 1";
  if (z.name().size() > 63 || z.corners().size() > v1::MAX_ZONE_CORNERS)
    return "a zone has too long a name or too many corners";
  if (!(z.z_min_m() >= -100 && z.z_max_m() <= 1000 && finite({z.z_min_m(), z.z_max_m()})))
    return "a zone's heights are not within -100 .. 1000 m";
  for (const v1::ZoneCorner& c : z.corners())
    if (!(std::abs(c.x_m()) <= 9e4 && std::abs(c.y_m()) <= 9e4))
      return "a zone's corner is not finite or too far away";
  if (!whole) return nullptr;
  if (z.kind() != v1::ZONE_NO_GO && z.kind() != v1::ZONE_SLOW_DOWN) return "unknown kind of zone";
  if (z.corners().size() < 3) return "a zone has fewer than three corners";
  if (!(z.z_min_m() < z.z_max_m())) return "a zone has no height";
  std::vector<Corner> outline;
  for (const v1::ZoneCorner& c : z.corners()) outline.push_back({c.x_m(), c.y_m()});
  if (!polygon_flaw(outline).empty())
    return "a zone's edges cross or touch, or it has no area: name its corners in their order";
  return nullptr;
}

template <class Tile>
const char* tile_flaw(const Tile& t) {
  if (t.time_ns() != 0 && !is_time(t.time_ns())) return "time out of range";
  if (!(t.voxel_m() >= 1e-3 && t.voxel_m() <= 10)) return "voxel size out of range";
  if (t.encoding() != 1) return "unknown encoding";
  if (t.payload().empty()) return "empty payload";
  return nullptr;
}

}  // namespace

const char* flaw(const StereoFrame& s) {
  if (s.broken() != nullptr) return s.broken();
  const auto format = pixel_format(s.encoding());
  if (!format) return "unknown image encoding";
  for (const std::size_t bytes : {s.left().size(), s.right().size()})
    if (const char* what = image_flaw(*format, s.width(), s.height(), bytes)) return what;
  if (!is_time(s.exposure_time_ns())) return "no exposure time";
  return nullptr;
}

const char* flaw(const v1::RangefinderPosition& s) {
  if (s.axis() < v1::AXIS_CART || s.axis() > v1::AXIS_CART_SECOND) return "unknown axis";
  if (!is_time(s.time_ns())) return "no measurement time";
  if (!finite({s.distance_m(), s.accuracy_m()})) return "distance or accuracy is not finite";
  if (!status_known(s.device_status())) return "unknown device status";
  return nullptr;
}

const char* flaw(const v1::HoistState& s) {
  if (!is_time(s.time_ns())) return "no measurement time";
  const auto within = [](double v, double low, double high) { return v >= low && v <= high; };
  if (!within(s.hook_height_m(), -100, 1000)) return "hook height is not within -100 .. 1000 m";
  if (!within(s.sling_m(), 0, 100)) return "length of the slings is not within 0 .. 100 m";
  for (const double size : {s.load_size_x_m(), s.load_size_y_m(), s.load_size_z_m()})
    if (!within(size, 0, 100)) return "size of the load is not within 0 .. 100 m";
  if (!within(s.load_yaw_rad(), -100, 100)) return "yaw of the load is not within -100 .. 100";
  for (const double sway : {s.sway_x_m(), s.sway_y_m()})
    if (!within(sway, -100, 100)) return "sway is not within -100 .. 100 m";
  if (!status_known(s.status())) return "unknown status";
  return nullptr;
}

const char* flaw(const PartialCloud& s) {
  if (s.broken() != nullptr) return s.broken();
  if (s.has_colour() > 1) return "has_colour is neither 0 nor 1";
  if (!image_fits(s.width(), s.height())) return "cloud size out of bounds";
  const std::size_t pixels = std::size_t{s.width()} * s.height();
  if (s.depth().size() != pixels || s.confidence().size() != pixels ||
      s.colour().size() != (s.has_colour() == 1 ? 3 * pixels : 0))
    return "depth, confidence or colour is not of width x height";
  if (!is_time(s.exposure_time_ns())) return "no exposure time";
  if (!finite({s.f_px(), s.cx_px(), s.cy_px(), s.baseline_m(), s.sigma_disparity_px()}))
    return "camera model is not finite";
  if (s.f_px() <= 1 || s.baseline_m() <= 0 || s.sigma_disparity_px() <= 0)
    return "camera model is not positive";
  if (!finite({s.row_offset_px(), s.row_offset_sigma_px(), s.row_roll_rad(), s.row_roll_sigma_rad(),
               s.row_slope(), s.row_slope_sigma()}))
    return "row error is not finite";
  if (s.row_offset_sigma_px() < 0 || s.row_roll_sigma_rad() < 0 || s.row_slope_sigma() < 0)
    return "a standard deviation is negative";
  for (double r : s.rotation())
    if (!(std::abs(r) <= 1.000001)) return "rotation is not a rotation";
  return nullptr;
}

const char* flaw(const v1::MapTile& s) {
  return tile_flaw(s);
}
const char* flaw(const v1::HeightTile& s) {
  return tile_flaw(s);
}

const char* flaw(const v1::OctreeMap& s) {
  if (!(s.voxel_m() >= 1e-3 && s.voxel_m() <= 10)) return "voxel size out of range";
  if (s.encoding() != 1) return "unknown encoding";
  if (s.payload().empty()) return "empty payload";
  // zstd packs zeros a hundred thousandfold: what is unpacked is bounded as what travels is.
  if (s.decoded_bytes() > kMaxOctreeDecoded) return "decoded_bytes out of range";
  return nullptr;
}

const char* flaw(const v1::MapStatus& s) {
  for (const std::int64_t time : {s.time_ns(), s.mapper_start_ns(), s.last_frame_time_ns()})
    if (time != 0 && !is_time(time)) return "time out of range";
  if (!(s.voxel_m() >= 1e-3 && s.voxel_m() <= 10)) return "voxel size out of range";
  if (!status_known(s.validity())) return "unknown validity";
  if (s.reason_code() > v1::MAP_DRIFTING) return "unknown reason_code";
  if (s.paper_method() > 1) return "paper_method is neither 0 nor 1";
  if (s.term() > 0x7FFFFFFFU) return "term out of range";
  if (s.hoist() > v1::HOIST_LOST) return "unknown state of the hoist";
  if (!(s.ceiling_m() >= 0 && s.ceiling_m() <= 1000)) return "ceiling_m is not within 0 .. 1000 m";
  if (!(s.forget_s() >= 0 && s.forget_s() <= 1e9)) return "forget_s out of range";
  if (s.reason().size() > 255) return "reason is too long";
  return nullptr;
}

const char* flaw(const v1::TileRequest& s) {
  if (!is_time(s.time_ns())) return "no time";
  return nullptr;
}

const char* flaw(const v1::ZoneSet& s) {
  if (s.zones().size() > v1::MAX_ZONES) return "too many zones";
  std::set<std::uint32_t> ids;
  for (const v1::Zone& zone : s.zones()) {
    if (const char* what = zone_flaw(zone, true)) return what;
    if (!ids.insert(zone.id()).second) return "two zones have the same id";
  }
  return nullptr;
}

const char* flaw(const v1::ZoneCommand& s) {
  if (s.action() < v1::ZONE_SET || s.action() > v1::ZONE_SWITCH) return "unknown action";
  return zone_flaw(s.zone(), s.action() == v1::ZONE_SET);
}

const char* flaw(const v1::ClearanceRequest& s) {
  if (s.path().empty() || s.path().size() > v1::MAX_PATH_POSES)
    return "path has no or too many poses";
  for (const v1::ClearancePose& p : s.path())
    if (!finite({p.x_m(), p.y_m(), p.z_m(), p.yaw_rad()})) return "a pose is not finite";
  if (!finite({s.load_size_x_m(), s.load_size_y_m(), s.load_size_z_m(), s.load_above_m(),
               s.margin_horizontal_m(), s.margin_vertical_m(), s.sway_m(), s.braking_m(),
               s.max_age_s()}))
    return "a length or age is not finite";
  return nullptr;
}

const char* flaw(const v1::ClearanceReply& s) {
  if (s.verdict() > v1::VERDICT_BLOCKED) return "unknown verdict";
  if (s.reason() > v1::CLEARANCE_FEW_VIEWS) return "unknown reason";
  if (s.has_safe_height() > 1 || s.slow_down() > 1)
    return "has_safe_height or slow_down is neither 0 nor 1";
  if (s.has_safe_height() == 1 &&
      !(s.safe_low_m() <= s.safe_height_m() && s.safe_height_m() <= s.safe_high_m()))
    return "safe_height_m is not within safe_low_m .. safe_high_m";
  if (!finite({s.safe_height_m(), s.safe_low_m(), s.safe_high_m(), s.first_x_m(), s.first_y_m(),
               s.first_z_m(), s.oldest_age_s(), s.unknown_fraction()}))
    return "a number is not finite";
  if (s.text().size() > 255) return "text is too long";
  return nullptr;
}

const char* flaw(const v1::ServiceStatus& s) {
  if (s.service() < v1::SERVICE_CAMERA || s.service() > kLastService) return "unknown service";
  if (!status_known(s.status())) return "unknown status";
  if (s.finished() > 1) return "finished is neither 0 nor 1";
  if (s.dropped().size() > v1::MAX_CAUSES || s.stages().size() > v1::MAX_STAGES ||
      s.figures().size() > v1::MAX_FIGURES)
    return "too many entries";
  if (!finite({s.cpu_seconds()})) return "cpu_seconds is not finite";
  for (const v1::StageTime& stage : s.stages())
    if (!finite({stage.p50_ms(), stage.p99_ms(), stage.max_ms()}))
      return "the time of a stage is not finite";
  for (const v1::StatusFigure& f : s.figures())
    if (!finite({f.value(), f.sigma()}) || f.sigma() < 0) return "a figure is not finite";
  return nullptr;
}

}  // namespace crane::dds
