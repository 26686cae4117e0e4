// SPDX-License-Identifier: Apache-2.0
#include "recording/recording.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <set>

#include "config/yaml_strict.hpp"
#include "recording/csv.hpp"
#include "recording/hoist_csv.hpp"
#include "recording/time_check.hpp"

namespace crane {
namespace {

constexpr TimeNs kMaxPairOffsetNs = 5'000'000;

Result<std::vector<RecordedDistance>> read_distances(const std::string& path) {
  auto rows = read_time_csv(path);
  if (!rows) return rows.error();
  std::vector<RecordedDistance> out;
  out.reserve(rows->size());
  for (const auto& [time, text] : *rows) {
    // Decimal, or as C libraries write that there is none; not 0x10, which strtod would take.
    static const std::set<std::string> kNone = {"nan", "-nan", "NaN", "NAN", "inf", "-inf", "Inf"};
    const std::optional<double> value =
        kNone.contains(text) ? std::optional(std::nan("")) : decimal_number(text);
    if (!value)
      return Error{ErrorCode::kBadData, path,
                   "'" + text + "' at time " + std::to_string(time) + " is not a distance",
                   "write metres, or nan where the device gave no reading"};
    out.push_back({time, *value});
  }
  return out;
}

Result<std::vector<RecordedFrame>> read_frames(const std::string& folder) {
  auto left = read_time_csv(folder + "/cam0/data.csv");
  if (!left) return left.error();
  auto right = read_time_csv(folder + "/cam1/data.csv");
  if (!right) return right.error();
  if (left->size() != right->size())
    return Error{ErrorCode::kBadData, folder,
                 "cam0 has " + std::to_string(left->size()) + " images, cam1 " +
                     std::to_string(right->size()),
                 "remove the lines without a partner from data.csv"};
  if (left->empty())
    return Error{ErrorCode::kBadData, folder + "/cam0/data.csv", "names no image", ""};
  std::vector<RecordedFrame> frames;
  for (std::size_t i = 0; i < left->size(); ++i) {
    const auto& [time, left_name] = (*left)[i];
    const auto& [right_time, right_name] = (*right)[i];
    if (std::abs(time - right_time) > kMaxPairOffsetNs)
      return Error{ErrorCode::kBadData, folder,
                   "image " + std::to_string(i) + ": left and right are " +
                       std::to_string(std::abs(time - right_time) / 1'000'000) + " ms apart",
                   "trigger both cameras together (5 ms at most), or remove the pair"};
    for (const std::string& name : {left_name, right_name})
      if (name.empty() || name.find('/') != std::string::npos || name == "..")
        return Error{ErrorCode::kBadData, folder, "'" + name + "' in data.csv is no file name",
                     "name files in the folder data beside data.csv"};
    frames.push_back(
        {time, folder + "/cam0/data/" + left_name, folder + "/cam1/data/" + right_name});
  }
  return frames;
}

template <class Samples>
Result<TimeCheck> checked(const std::string& file, const Samples& samples) {
  TimeCheck check(file);
  for (const auto& sample : samples)
    if (auto step = check.add(sample.time); !step) return step.error();
  return check;
}

/// Times of all sensors, of one clock.
Result<void> check_times(const Recording& r) {
  const auto frames = checked(r.folder() + "/cam0/data.csv", r.frames());
  if (!frames) return frames.error();
  if (auto unit = frames->check_unit(); !unit) return unit;
  const auto cart = checked(r.folder() + "/cart0/data.csv", r.cart());
  const auto trolley = checked(r.folder() + "/trolley0/data.csv", r.trolley());
  const auto second = checked(r.folder() + "/cart1/data.csv", r.cart_second());
  const auto hoist = checked(r.folder() + "/hoist0/data.csv", r.hoist());
  for (const auto* sensor : {&cart, &second, &trolley, &hoist}) {
    if (!*sensor) return sensor->error();
    if (auto together = (*sensor)->check_with(*frames); !together) return together;
  }
  return {};
}

}  // namespace

Result<Recording> Recording::open(const std::string& folder) {
  Recording r;
  r.folder_ = folder;
  auto rig = read_rig(folder);
  if (!rig) return rig.error();
  r.rig_ = *rig;
  auto frames = read_frames(folder);
  if (!frames) return frames.error();
  r.frames_ = std::move(*frames);
  for (const char* axis : {"cart0", "trolley0"}) {
    const bool cart = std::string(axis) == "cart0";
    auto model = read_rangefinder(folder + "/" + axis + "/sensor.yaml");
    if (!model) return model.error();
    (cart ? r.cart_model_ : r.trolley_model_) = *model;
    auto distances = read_distances(folder + "/" + axis + "/data.csv");
    if (!distances) return distances.error();
    if (distances->empty())
      return Error{ErrorCode::kBadData, folder + "/" + axis, "has no reading",
                   "without positions nothing can be mapped"};
    (cart ? r.cart_ : r.trolley_) = std::move(*distances);
  }
  std::error_code unreadable;
  if (std::filesystem::exists(folder + "/cart1/data.csv", unreadable)) {
    auto distances = read_distances(folder + "/cart1/data.csv");
    if (!distances) return distances.error();
    r.cart_second_ = std::move(*distances);
  }
  auto hoist = read_hoist_csv(folder + "/hoist0/data.csv");
  if (!hoist) return hoist.error();
  r.hoist_ = std::move(*hoist);
  if (auto times = check_times(r); !times) return times.error();
  return r;
}

TimeNs Recording::start() const {
  return std::min({frames_.front().time, cart_.front().time, trolley_.front().time});
}

TimeNs Recording::end() const {
  return std::max({frames_.back().time, cart_.back().time, trolley_.back().time});
}

TimeNs Recording::loop_period() const {
  const TimeNs step = frames_.size() > 1 ? (frames_.back().time - frames_.front().time) /
                                               static_cast<TimeNs>(frames_.size() - 1)
                                         : kNsPerSecond;
  return end() - start() + step;
}

}  // namespace crane
