// SPDX-License-Identifier: Apache-2.0
#include "mount/commissioning.hpp"

#include <cmath>

#include "base/format.hpp"
#include "config/yaml_reader.hpp"
#include "config/yaml_text.hpp"

namespace crane {
namespace {

constexpr double kSigmas = 3;

/// What a change of it must be to matter, and what to do then.
struct Matter {
  double least;
  const char* todo;
};

Matter matter_of(MountItem item) {
  switch (item) {
    case MountItem::kHeight:
      return {0.005, "look at the mount and at the floor below; then cranemap calibrate mount"};
    case MountItem::kTiltX:
    case MountItem::kTiltY:
    case MountItem::kYaw:
      return {0.1, "the camera has turned: look for loose bolts; then cranemap calibrate mount"};
    case MountItem::kCartDirection:
    case MountItem::kTrolleyDirection:
      return {0.5, "the rangefinder stands at the other end now: cranemap calibrate mount"};
    case MountItem::kCartScale:
    case MountItem::kTrolleyScale:
      return {0.003, "look at the rangefinder's beam along the rail and at its unit"};
    case MountItem::kCartLatency:
    case MountItem::kTrolleyLatency:
      return {15, "look at the clocks (cranemap doctor) and at the device's averaging"};
    case MountItem::kCartOffset:
    case MountItem::kTrolleyOffset:
    case MountItem::kCartSecondOffset:
      return {0.02, "the rangefinder or its target has moved"};
    case MountItem::kSkew:
      return {0.1, "the bridge stands more skew: look at its wheels and drives"};
    case MountItem::kFloorSlopeX:
    case MountItem::kFloorSlopeY:
      return {0.2, "measured over another part of the floor, or the rails have settled"};
    case MountItem::kHookX:
    case MountItem::kHookY:
      return {0.1, "the hook hangs elsewhere: was the rope reeved anew?"};
  }
  return {0, ""};
}

}  // namespace

Commissioning commissioning_of(const MountCalibration& c, const std::string& date) {
  Commissioning out;
  out.date = date;
  for (const MountValue& v : c.values)
    if (v.determined) out.values.push_back({v.item, v.value, v.sigma});
  return out;
}

std::string to_yaml(const Commissioning& commissioning) {
  std::string out =
      "# What was measured when the crane was commissioned; cranemap check compares with it.\n"
      "date: " +
      yaml_quoted(commissioning.date) + "\nmount:\n";
  for (const Commissioning::Value& v : commissioning.values)
    out += formatted("  %s: [", name_of(v.item).key) + yaml_exact(v.value) + ", " +
           yaml_exact(v.sigma) + "]  # value, standard deviation\n";
  if (commissioning.values.empty()) out += "  {}\n";
  return out;
}

static Result<Commissioning> read(YamlReader reader) {
  Commissioning out;
  reader.text("date", out.date);
  YamlReader mount = reader.section("mount", true);
  for (std::size_t i = 0; i < kMountItems; ++i) {
    const char* key = name_of(MountItem(i)).key;
    if (!mount.has(key)) continue;
    std::vector<double> numbers;
    mount.numbers(key, numbers, 2);
    if (numbers.size() != 2) continue;
    if (numbers[1] < 0) mount.problem(key, "has a standard deviation below 0");
    out.values.push_back({MountItem(i), numbers[0], numbers[1]});
  }
  if (auto done = reader.finish(); !done) return done.error();
  return out;
}

Result<Commissioning> read_commissioning(const std::string& path) {
  auto reader = YamlReader::from_file(path);
  if (!reader) return reader.error();
  return read(std::move(*reader));
}

Result<Commissioning> parse_commissioning(const std::string& text, const std::string& name) {
  auto reader = YamlReader::from_text(text, name);
  if (!reader) return reader.error();
  return read(std::move(*reader));
}

std::vector<CheckedItem> compare(const Commissioning& then, const MountCalibration& now) {
  std::vector<CheckedItem> out;
  for (const Commissioning::Value& old : then.values) {
    const MountValue& v = now.of(old.item);
    const MountItemName& name = name_of(old.item);
    CheckedItem item;
    item.item = old.item;
    item.then = old.value;
    if (!v.determined) {
      item.text = formatted("%s: not measured this time, ", name.what) + v.why_not;
      out.push_back(item);
      continue;
    }
    item.now = v.value;
    item.sigma = std::hypot(old.sigma, v.sigma);
    const Matter matter = matter_of(old.item);
    const double change = item.now - item.then;
    const bool changed = std::abs(change) > kSigmas * item.sigma && std::abs(change) > matter.least;
    item.state = changed ? CheckState::kChanged : CheckState::kSame;
    const std::string unit = name.unit[0] == '\0' ? "" : formatted(" %s", name.unit);
    item.text = formatted("%s: %.*f%s then, %.*f now", name.what, name.decimals, item.then,
                          unit.c_str(), name.decimals, item.now);
    if (changed)
      item.text += formatted(", CHANGED by %.*f +- %.*f%s -> %s", name.decimals, change,
                             name.decimals, item.sigma, unit.c_str(), matter.todo);
    else if (item.sigma > 0)
      item.text += formatted(", same within the uncertainty (%.*f%s)", name.decimals, item.sigma,
                             unit.c_str());
    else
      item.text += ", same";
    out.push_back(item);
  }
  return out;
}

}  // namespace crane
