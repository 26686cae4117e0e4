// SPDX-License-Identifier: Apache-2.0
// A site's file is changed where something was measured, and nowhere else.

#include "config/yaml_edit.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace crane {
namespace {

using ::testing::HasSubstr;

/// Read, changed, written.
std::string changed(const std::string& text, const std::function<void(SiteConfig&)>& change) {
  auto config = parse_site_config(text, "site.yaml");
  EXPECT_TRUE(config) << (config ? "" : config.error().text());
  if (!config) return "";
  change(*config);
  const auto out = with_values(text, "site.yaml", *config);
  return out ? *out : "ERROR " + out.error().text();
}

constexpr const char* kSite = R"(# Hall 3, crane 1. Müller, tel. 4711
crane: 1
camera: {source: folder, path: /var/pictures, remove: true}   # the SDK writes there
rangefinders:
  # the bridge; its target was moved in May
  - {axis: cart, device: dimetix, port: /dev/ttyUSB0}
  - axis: trolley
    device: sick-dl100
    port: '/dev/ttyUSB1'  # the left plug
    scale: 1.0
mapper:
  voxel_m: 0.05   # finer is too slow here
  cart_direction: -1
# the end
)";

TEST(YamlEdit, ChangesValuesAndKeepsEveryOtherByte) {
  std::string wanted = kSite;
  const auto put = [&wanted](const std::string& from, const std::string& to) {
    const auto at = wanted.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    wanted.replace(at, from.size(), to);
  };
  put("cart_direction: -1", "cart_direction: 1");
  put("scale: 1.0", "scale: 1.0125");
  EXPECT_EQ(changed(kSite,
                    [](SiteConfig& c) {
                      c.mapper.cart_direction = 1;
                      c.rangefinders[1].scale = 1.0125;
                    }),
            wanted);
  EXPECT_EQ(changed(kSite, [](SiteConfig&) {}), kSite);
}

TEST(YamlEdit, PutsWhatIsNotThereIntoItsSectionOrANewOne) {
  const std::string out = changed(kSite, [](SiteConfig& c) {
    c.mapper.cart_latency_ms = 80;
    c.mapper.trolley_offset_m = -1.25;
    c.rangefinders[0].scale = 0.995;
    c.hoist.offset_x_m = 0.35;
    c.hoist.offset_y_m = -0.05;
  });
  EXPECT_THAT(out, HasSubstr("  cart_latency_ms: 80\n"));
  EXPECT_THAT(out, HasSubstr("  - {scale: 0.995, axis: cart, device: dimetix"));
  EXPECT_THAT(out, HasSubstr("# the end\nhoist:\n  offset_x_m: 0.35\n  offset_y_m: -0.05\n"));
  for (const char* comment :
       {"Müller", "the SDK writes there", "moved in May", "the left plug", "finer is too slow"})
    EXPECT_THAT(out, HasSubstr(comment));
}

TEST(YamlEdit, KeepsLineEndsAndTakesAFileWithoutTheLast) {
  EXPECT_EQ(changed("crane: 1\r\nmapper:\r\n  voxel_m: 0.05 # a\r\n",
                    [](SiteConfig& c) { c.mapper.voxel_m = 0.1; }),
            "crane: 1\r\nmapper:\r\n  voxel_m: 0.1 # a\r\n");
  EXPECT_EQ(changed("crane: 1", [](SiteConfig& c) { c.mapper.voxel_m = 0.1; }),
            "crane: 1\nmapper:\n  voxel_m: 0.1\n");
  EXPECT_EQ(changed("# nothing yet\n", [](SiteConfig& c) { c.crane = 2; }),
            "# nothing yet\ncrane: 2\n");
  EXPECT_EQ(changed("{crane: 1, hoist: {}} # short\n",
                    [](SiteConfig& c) {
                      c.mapper.voxel_m = 0.1;
                      c.hoist.offset_x_m = 0.35;
                    }),
            "{mapper: {voxel_m: 0.1}, crane: 1, hoist: {offset_x_m: 0.35}} # short\n");
}

TEST(YamlEdit, SaysWhatItCannotChangeInsteadOfLosingIt) {
  EXPECT_THAT(changed(kSite, [](SiteConfig& c) { c.rangefinders.pop_back(); }),
              HasSubstr("keep its comments: rangefinders[1]"));
  EXPECT_FALSE(with_values("crane: [", "site.yaml", SiteConfig{}));
}

}  // namespace
}  // namespace crane
