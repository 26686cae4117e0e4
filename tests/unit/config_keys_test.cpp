// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>
#include <vector>

#include "config/key.hpp"
#include "config/nearest_name.hpp"
#include "config/reference.hpp"
#include "config/site_config.hpp"

namespace crane {
namespace {

/// One of everything that may be there more than once.
constexpr const char* kFull =
    "rangefinders:\n"
    "  - {axis: cart, device: telegram, port: 'udp://10.0.0.5:4000', unit_m: 0.001,\n"
    "     telegram: {length: 64, value_offset: 8}}\n"
    "  - {axis: trolley, device: modbus, port: 'tcp://10.0.0.6', unit_m: 0.001,\n"
    "     modbus: {value_register: 4}}\n"
    "zones:\n"
    "  - {id: 3, corners: [{x: 0, y: 0}, {x: 5, y: 0}, {x: 5, y: 5}]}\n";

SiteConfig full_site() {
  auto site = parse_site_config(kFull, "full");
  EXPECT_TRUE(site) << site.error().text();
  return *site;
}

/// Gives the value number `which` another one that is allowed by itself.
class Nudge final : public KeyVisitor {
 public:
  explicit Nudge(std::size_t which) : which_(which) {}
  std::string path;  ///< what was changed; empty: there are not so many

  void number(const Key& key, double& value, const Range& r) override {
    if (!due(key)) return;
    const double middle = r.least + (r.most - r.least) * 0.4375;
    value = fits(r, middle) && value != middle ? middle : other_end(value, r);
  }
  void whole(const Key& key, int& value, const Range& r) override {
    if (due(key)) value = static_cast<int>(other_end(value, r));
  }
  void flag(const Key& key, bool& value) override {
    if (due(key)) value = !value;
  }
  void text(const Key& key, std::string& value, std::size_t /*most*/) override {
    if (due(key)) value += "x: '\"\\\n#";
  }
  void texts(const Key& key, std::vector<std::string>& value) override {
    if (due(key)) value.emplace_back("10.1.2.3");
  }
  bool one_of(const Key& key, int& index, const std::vector<std::string>& names) override {
    if (due(key)) index = (index + 1) % static_cast<int>(names.size());
    return true;
  }

 protected:
  bool open(const Key& key, const Use& use) override {
    if (use.used) at_.push_back(at_.back() + key.name + ".");
    return use.used;
  }
  void close() override { at_.pop_back(); }
  std::size_t open_list(const Key& key, std::size_t size, std::size_t /*most*/) override {
    lists_.push_back(at_.back() + key.name);
    return size;
  }
  void open_item(std::size_t i) override {
    at_.push_back(lists_.back() + "[" + std::to_string(i) + "].");
  }
  void close_item() override { at_.pop_back(); }
  void close_list() override { lists_.pop_back(); }

 private:
  bool due(const Key& key) {
    if (seen_++ != which_) return false;
    path = at_.back() + key.name;
    return true;
  }
  static bool fits(const Range& r, double v) { return r.rule.holds == nullptr || r.rule.holds(v); }
  static double other_end(double value, const Range& r) {
    return value != r.least && fits(r, r.least) ? r.least : r.most;
  }

  std::size_t which_, seen_ = 0;
  std::vector<std::string> at_ = {""}, lists_;
};

TEST(ConfigKeys, EveryKeyIsComparedWrittenAndReadBackAsItIs) {
  const SiteConfig full = full_site();
  std::size_t keys_seen = 0;
  std::size_t read_back = 0;
  for (;; ++keys_seen) {
    SiteConfig changed = full;
    Nudge nudge(keys_seen);
    keys(nudge, changed);
    if (nudge.path.empty()) break;
    // A device's section comes and goes with it.
    const bool is_device = nudge.path.ends_with(".device");
    const auto differs = changed_keys(changed, full);
    ASSERT_FALSE(differs.empty()) << nudge.path;
    EXPECT_EQ(differs.front(), nudge.path);
    if (!is_device && nudge.path != "dds.network") EXPECT_EQ(differs.size(), 1U) << nudge.path;
    // Some do not go with the others: then the file says so, and never reads as something else.
    const auto again = parse_site_config(to_yaml(changed), "again");
    if (!again) {
      EXPECT_NE(again.error().text().find("again:"), std::string::npos) << nudge.path;
      continue;
    }
    ++read_back;
    EXPECT_EQ(changed_keys(*again, changed), std::vector<std::string>()) << nudge.path;
  }
  const std::vector<KeyRow> rows = values_of(full);
  EXPECT_EQ(std::ptrdiff_t(keys_seen),
            std::count_if(rows.begin(), rows.end(), [](const KeyRow& r) { return !r.is_section; }));
  EXPECT_GT(read_back, keys_seen * 3 / 4);
}

TEST(ConfigKeys, EachSaysWhatItIsAndHasItsOwnPlace) {
  std::set<std::string> paths;
  for (const KeyRow& row : all_keys()) {
    EXPECT_GT(row.text.size(), 3U) << row.path;
    EXPECT_TRUE(row.is_section || !row.allowed.empty()) << row.path;
    EXPECT_TRUE(paths.insert(row.path).second) << row.path;
    EXPECT_EQ(row.text.find('\n'), std::string::npos) << row.path;
  }
  EXPECT_GT(paths.size(), 120U);
  for (const char* key : {"crane", "dds.domain", "mapper.voxel_m", "rangefinders[].modbus.unit",
                          "rangefinders[].telegram.length", "zones[].corners[].x"})
    EXPECT_TRUE(paths.contains(key)) << key;
}

TEST(ConfigKeys, DefaultsAreAllowed) {
  const auto defaults = parse_site_config(to_yaml(SiteConfig{}), "defaults");
  ASSERT_TRUE(defaults) << defaults.error().text();
  EXPECT_EQ(changed_keys(*defaults, SiteConfig{}), std::vector<std::string>());
}

std::string refusal(const std::string& text) {
  const auto read = parse_site_config(text, "site.yaml");
  return read ? "" : read.error().text();
}

TEST(ConfigKeys, ATypoIsToldWithTheKeyThatIsMeant) {
  EXPECT_NE(
      refusal("mapper:\n  voxel_mm: 1\n")
          .find("site.yaml:2: unknown key 'mapper.voxel_mm' ('voxel_m' is meant? known here: "),
      std::string::npos)
      << refusal("mapper:\n  voxel_mm: 1\n");
  EXPECT_NE(refusal("mappr: {}\n").find("'mapper' is meant?"), std::string::npos);
  EXPECT_NE(refusal("mapper: {trolly_direction: 1}\n").find("'trolley_direction' is meant?"),
            std::string::npos);
  EXPECT_EQ(refusal("mapper: {zzz: 1}\n").find("is meant?"), std::string::npos);
  EXPECT_EQ(refusal("{'" + std::string(100'000, 'v') + "': 1}\n").find("is meant?"),
            std::string::npos);
}

TEST(ConfigKeys, WhatIsWrongIsToldWithItsLineAndWhatIsAllowed) {
  EXPECT_NE(refusal("stereo:\n  left_right_px: 17\n")
                .find("site.yaml:2: 'stereo.left_right_px' 17 is outside -1 .. 16"),
            std::string::npos);
  EXPECT_NE(refusal("mapper:\n  forget_s: 0.5\n")
                .find("site.yaml:2: 'mapper.forget_s' must be 0 (never) or at least 1"),
            std::string::npos);
  EXPECT_NE(refusal("mapper: {cart_direction: 0}\n").find("must be 1 or -1"), std::string::npos);
  EXPECT_NE(refusal("rangefinders:\n  - {device: text, port: /dev/x, unit_m: 1}\n")
                .find("site.yaml:2: 'rangefinders[0].axis' is missing; one of: cart, trolley"),
            std::string::npos);
  // No guess about a device that is not known.
  const std::string unknown = refusal("rangefinders:\n  - {axis: cart, device: x, port: /dev/x}\n");
  EXPECT_NE(unknown.find("1 problem(s)"), std::string::npos) << unknown;
}

TEST(ConfigKeys, ASectionOfAnotherDeviceIsAProblem) {
  const std::string said = refusal(
      "rangefinders:\n  - {axis: cart, device: text, port: /dev/x, unit_m: 1,\n"
      "     telegram: {length: 8}}\n");
  EXPECT_NE(said.find("site.yaml:3: 'rangefinders[0].telegram' is for device: telegram"),
            std::string::npos)
      << said;
}

TEST(ConfigKeys, SharedMemoryFollowsTheNetworkUnlessItIsSaid) {
  EXPECT_TRUE(parse_site_config("{}", "x")->dds.uses_shared_memory());
  EXPECT_FALSE(parse_site_config("dds: {network: container}", "x")->dds.uses_shared_memory());
  EXPECT_TRUE(parse_site_config("dds: {network: container, shared_memory: true}", "x")
                  ->dds.uses_shared_memory());
  EXPECT_FALSE(parse_site_config("dds: {shared_memory: false}", "x")->dds.uses_shared_memory());
}

TEST(ConfigKeys, ManyCornersAreRefusedWithoutTryingTheirOutline) {
  std::string text = "zones:\n  - {id: 1, corners: [";
  for (int i = 0; i < 40'000; ++i) text += "{x: 1, y: " + std::to_string(i % 7) + "}, ";
  const std::string said = refusal(text + "]}\n");
  EXPECT_NE(said.find("'zones[0].corners' are more than 32"), std::string::npos)
      << said.substr(0, 300);
}

TEST(ConfigKeys, AKeyIsDescribedAndATypoOfItToo) {
  const auto key = described("mapper.voxel_m");
  ASSERT_TRUE(key);
  EXPECT_NE(key->find("mapper.voxel_m [m]: edge of a voxel"), std::string::npos) << *key;
  EXPECT_NE(key->find("allowed: 0 .. 2, 0 (automatic) or at least 0.005"), std::string::npos);
  EXPECT_NE(described("zones")->find("zones[].corners[].x [m]"), std::string::npos);
  EXPECT_NE(described("")->find("watchdog.jump_m"), std::string::npos);
  const auto typo = described("mapper.voxel");
  ASSERT_FALSE(typo);
  EXPECT_NE(typo.error().todo.find("'mapper.voxel_m'"), std::string::npos) << typo.error().todo;
}

}  // namespace
}  // namespace crane
