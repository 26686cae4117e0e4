// SPDX-License-Identifier: Apache-2.0
#include "mapper/zone_book.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "bounds.h"
#include "dds/validate.hpp"
#include "service/zone_sample.hpp"
#include "temp_folder.hpp"

namespace crane {
namespace {

ZoneConfig triangle(int id, bool switchable = false) {
  ZoneConfig z;
  z.id = id;
  z.name = "zone \"" + std::to_string(id) + "\"";
  z.switchable = switchable;
  z.z_max_m = 3;
  z.corners = {{0, 0}, {2, 0}, {1, 1.5}};
  return z;
}

v1::ZoneCommand command(std::uint32_t action, const ZoneConfig& zone, std::uint64_t number,
                        bool active = true) {
  v1::ZoneCommand c;
  c.crane(1);
  c.action(action);
  c.client(77);
  c.sequence_number(number);
  c.time_ns(1);
  c.zone(to_sample(zone));
  c.zone().active(active ? 1 : 0);
  EXPECT_EQ(dds::flaw(c), nullptr);
  return c;
}

TEST(ZoneBook, FixedZonesCannotBeChangedByTopicAndSwitchableOnesOnlySwitched) {
  auto book = *ZoneBook::open({triangle(1), triangle(2, true)}, "");
  EXPECT_EQ(book.revision(), 1U);
  EXPECT_FALSE(book.apply(command(v1::ZONE_SWITCH, triangle(1), 1, false)));
  EXPECT_FALSE(book.apply(command(v1::ZONE_REMOVE, triangle(1), 2)));
  EXPECT_FALSE(book.apply(command(v1::ZONE_SET, triangle(2), 3)));
  EXPECT_FALSE(book.apply(command(v1::ZONE_REMOVE, triangle(2), 4)));
  EXPECT_EQ(book.revision(), 1U);
  EXPECT_TRUE(book.apply(command(v1::ZONE_SWITCH, triangle(2), 5, false)));
  EXPECT_EQ(book.revision(), 2U);
  const v1::ZoneSet set = book.set(1, 9);
  EXPECT_EQ(dds::flaw(set), nullptr);
  EXPECT_EQ(set.map_id(), 9U);
  EXPECT_EQ(set.zones().at(0).active(), 1U);
  EXPECT_EQ(set.zones().at(1).active(), 0U);
}

TEST(ZoneBook, ACommandSentTwiceIsDoneOnce) {
  auto book = *ZoneBook::open({}, "");
  EXPECT_EQ(book.revision(), 0U);
  EXPECT_TRUE(book.apply(command(v1::ZONE_SET, triangle(5), 1)));
  EXPECT_TRUE(book.apply(command(v1::ZONE_REMOVE, triangle(5), 2)));
  EXPECT_TRUE(book.apply(command(v1::ZONE_SET, triangle(5), 1))) << "late, and known";
  EXPECT_TRUE(book.set(1, 1).zones().empty());
  EXPECT_EQ(book.revision(), 2U);
}

TEST(ZoneBook, WhatCameByTopicSurvivesARestart) {
  const test::TempFolder folder;
  {
    auto book = *ZoneBook::open({triangle(2, true)}, folder.path());
    EXPECT_TRUE(book.apply(command(v1::ZONE_SET, triangle(5), 1)));
    EXPECT_TRUE(book.apply(command(v1::ZONE_SWITCH, triangle(2), 2, false)));
  }
  auto again = ZoneBook::open({triangle(2, true)}, folder.path());
  ASSERT_TRUE(again) << again.error().text();
  const v1::ZoneSet set = again->set(1, 1);
  ASSERT_EQ(set.zones().size(), 2U);
  EXPECT_EQ(set.zones()[0].active(), 0U);
  EXPECT_EQ(set.zones()[1].id(), 5U);
  EXPECT_STREQ(set.zones()[1].name().c_str(), "zone \"5\"");
  std::ofstream(folder / "zones.yaml") << "zones: [{id: x}]";
  const auto damaged = ZoneBook::open({}, folder.path());
  ASSERT_FALSE(damaged);
  EXPECT_NE(damaged.error().text().find("zones.yaml"), std::string::npos);
}

TEST(ZoneBook, HoldsSixtyFourZonesAndNoMore) {
  auto book = *ZoneBook::open({}, "");
  for (int id = 1; id <= 64; ++id)
    EXPECT_TRUE(book.apply(command(v1::ZONE_SET, triangle(id), std::uint64_t(id))));
  EXPECT_FALSE(book.apply(command(v1::ZONE_SET, triangle(65), 65)));
  EXPECT_TRUE(book.apply(command(v1::ZONE_SET, triangle(64), 66))) << "a known one changes";
}

TEST(ZoneBook, AReadAgainConfigurationKeepsSwitchesAndWhatCameByTopic) {
  auto book = *ZoneBook::open({triangle(1), triangle(2, true)}, "");
  ASSERT_TRUE(book.apply(command(v1::ZONE_SWITCH, triangle(2, true), 1, false)));
  ASSERT_TRUE(book.apply(command(v1::ZONE_SET, triangle(7), 2)));
  const std::uint64_t before = book.revision();
  ZoneConfig moved = triangle(2, true);
  moved.corners[0].x_m = -1;
  ASSERT_TRUE(book.reload({moved, triangle(3)}));
  EXPECT_GT(book.revision(), before);
  const v1::ZoneSet set = book.set(1, 42);
  ASSERT_EQ(set.zones().size(), 3U);  // by number: 2, 3, 7; 1 is gone
  EXPECT_EQ(set.zones()[0].id(), 2U);
  EXPECT_EQ(set.zones()[0].active(), 0U) << "still switched off";
  EXPECT_EQ(set.zones()[0].corners()[0].x_m(), -1);
  EXPECT_EQ(set.zones()[1].id(), 3U);
  EXPECT_EQ(set.zones()[2].id(), 7U);
  EXPECT_FALSE(book.apply(command(v1::ZONE_REMOVE, triangle(3), 3))) << "it is configured";
}

TEST(ZoneBook, AStandbyHasTheSwitchesAndZonesOfTheMapperThatServed) {
  auto served = *ZoneBook::open({triangle(1), triangle(2, true)}, "");
  ASSERT_TRUE(served.apply(command(v1::ZONE_SWITCH, triangle(2, true), 1, false)));
  ASSERT_TRUE(served.apply(command(v1::ZONE_SET, triangle(7), 2)));
  auto standby = *ZoneBook::open({triangle(1), triangle(2, true)}, "");
  standby.follow(served.set(1, 42));
  EXPECT_GT(standby.revision(), served.revision());
  EXPECT_EQ(standby.set(1, 42).zones(), served.set(1, 42).zones());
}

/// A set of more than its bound is refused by every reader: then there would be no zone at all.
TEST(ZoneBook, NeverSaysMoreZonesThanASetHoldsWhereverTheyComeFrom) {
  const test::TempFolder folder;
  std::vector<ZoneConfig> many, others;
  for (int i = 1; i <= 40; ++i) many.push_back(triangle(i));
  for (int i = 101; i <= 160; ++i) others.push_back(triangle(i, true));
  SiteConfig kept;
  kept.zones = others;
  std::ofstream(folder / "zones.yaml") << to_yaml(kept);
  const auto all_of = [](const ZoneBook& book, const std::vector<ZoneConfig>& zones) {
    std::size_t found = 0;
    const v1::ZoneSet set = book.set(1, 1);
    for (const v1::Zone& zone : set.zones())
      for (const ZoneConfig& z : zones)
        found += static_cast<std::uint32_t>(z.id) == zone.id() ? 1 : 0;
    return found == zones.size();
  };
  auto from_disk = *ZoneBook::open(many, folder.path());
  EXPECT_EQ(dds::flaw(from_disk.set(1, 1)), nullptr);
  EXPECT_EQ(from_disk.set(1, 1).zones().size(), v1::MAX_ZONES);
  EXPECT_TRUE(all_of(from_disk, many)) << "those of the configuration go first";
  EXPECT_EQ(from_disk.given_up(), 36U);

  auto standby = *ZoneBook::open(many, "");
  standby.follow(ZoneBook::open(others, "")->set(1, 1));
  EXPECT_EQ(dds::flaw(standby.set(1, 1)), nullptr);
  EXPECT_TRUE(all_of(standby, many));

  auto reloaded = *ZoneBook::open({}, folder.path());
  EXPECT_TRUE(reloaded.reload(many));
  EXPECT_EQ(dds::flaw(reloaded.set(1, 1)), nullptr);
  EXPECT_TRUE(all_of(reloaded, many));
}

}  // namespace
}  // namespace crane
