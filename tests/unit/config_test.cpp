#include <gtest/gtest.h>

#include "config/site_config.hpp"
#include "config/yaml_reader.hpp"

namespace crane {
namespace {

TEST(SiteConfig, DefaultsSurviveARoundTrip) {
  const auto read = parse_site_config(to_yaml(SiteConfig{}), "defaults");
  ASSERT_TRUE(read) << read.error().text();
  EXPECT_EQ(to_yaml(*read), to_yaml(SiteConfig{}));
}

TEST(SiteConfig, ReportsEveryProblemAtOnceWithItsLine) {
  const auto read = parse_site_config(
      "crane: 0\n"
      "stereo: {block_px: 8}\n"
      "mapper:\n"
      "  voxel_m: wide\n"
      "  voxel_size: 0.05\n",
      "site.yaml");
  ASSERT_FALSE(read);
  const std::string text = read.error().text();
  EXPECT_EQ(read.error().code, ErrorCode::kConfiguration);
  EXPECT_NE(text.find("4 problem(s)"), std::string::npos) << text;
  EXPECT_NE(text.find("site.yaml:1: 'crane' 0 is outside"), std::string::npos) << text;
  EXPECT_NE(text.find("site.yaml:2: 'stereo.block_px' must be odd"), std::string::npos) << text;
  EXPECT_NE(text.find("site.yaml:4: 'mapper.voxel_m' is not a number"), std::string::npos) << text;
  EXPECT_NE(text.find("site.yaml:5: unknown key 'mapper.voxel_size'"), std::string::npos) << text;
}

TEST(SiteConfig, RefusesWhatDoesNotFitTogether) {
  EXPECT_FALSE(parse_site_config("stereo: {nearest_m: 3, farthest_m: 2}", "x"));
  EXPECT_FALSE(parse_site_config("mapper: {voxel_m: 0.001}", "x"));
  EXPECT_FALSE(parse_site_config("dds: {profile_file: a.xml}", "x"));
  EXPECT_FALSE(parse_site_config("dds: {domain: 233}", "x"));
}

TEST(SiteConfig, RefusesWhatIsNoYamlOrNoMap) {
  EXPECT_FALSE(parse_site_config("a: [", "x"));
  EXPECT_FALSE(parse_site_config("- 1\n- 2\n", "x"));
  EXPECT_FALSE(parse_site_config("mapper: 3", "x"));
  EXPECT_FALSE(parse_site_config(std::string(5000, '['), "x"));
  EXPECT_TRUE(parse_site_config("", "x"));
}

TEST(SiteConfig, NamesAMissingFile) {
  const auto read = read_site_config("/nowhere/site.yaml");
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().where, "/nowhere/site.yaml");
}

}  // namespace
}  // namespace crane
