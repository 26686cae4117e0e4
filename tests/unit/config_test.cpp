// SPDX-License-Identifier: Apache-2.0
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

TEST(SiteConfig, APageForOthersNeedsATokenOrAClientsCertificate) {
  const auto problem = [](const std::string& gateway) {
    const auto read = parse_site_config("gateway: {address: 0.0.0.0" + gateway + "}", "x");
    return read ? "" : read.error().text();
  };
  const std::string tls = ", tls_certificate: a.pem, tls_key: a.key";
  EXPECT_NE(problem("").find("tls_client_ca"), std::string::npos);
  EXPECT_NE(problem(tls), "") << "TLS alone lets everybody in";
  EXPECT_EQ(problem(", token_file: t"), "");
  EXPECT_EQ(problem(tls + ", tls_client_ca: ca.pem"), "");
  EXPECT_NE(problem(", tls_client_ca: ca.pem").find("needs tls_certificate"), std::string::npos);
  EXPECT_NE(problem(", token_file: t, tls_key: a.key").find("both, or neither"), std::string::npos);
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

TEST(SiteConfig, HoistAndZonesReadBackAsWritten) {
  const std::string text =
      "hoist: {enabled: true, offset_y_m: 0.4, margin_m: 0.2}\n"
      "mapper: {forget_s: 120}\n"
      "zones:\n"
      "  - {id: 3, name: \"a: 'cell'\", kind: no-go, z_max_m: 2, corners: [{x: 0, y: 0}, {x: 1.5, "
      "y: 0}, "
      "{x: 1, y: 2}]}\n"
      "  - {id: 4, kind: slow-down, switchable: true, active: false, corners: [{x: 0, y: 0}, {x: "
      "1, y: "
      "0}, {x: 1, y: 2}]}\n";
  const auto config = parse_site_config(text, "test");
  ASSERT_TRUE(config) << config.error().text();
  const auto again = parse_site_config(to_yaml(*config), "again");
  ASSERT_TRUE(again) << again.error().text();
  EXPECT_EQ(to_yaml(*again), to_yaml(*config));
  EXPECT_TRUE(again->hoist.enabled);
  EXPECT_EQ(again->mapper.forget_s, 120);
  ASSERT_EQ(again->zones.size(), 2U);
  EXPECT_EQ(again->zones[0].name, "a: 'cell'");
  EXPECT_TRUE(again->zones[1].slow_down);
  EXPECT_FALSE(again->zones[1].active);
  EXPECT_EQ(again->zones[0].corners[1].x_m, 1.5);
}

TEST(SiteConfig, EveryWrongZoneIsNamedWithItsLine) {
  const auto config = parse_site_config(
      "zones:\n  - {id: 3, corners: [{x: 0, y: 0}]}\n  - {id: 3, z_min_m: 5, z_max_m: 1, corners: "
      "[{x: 0, "
      "y: 0}, {x: 1, y: 0}, {x: 1, y: nan}]}\n",
      "zones.yaml");
  ASSERT_FALSE(config);
  const std::string said = config.error().text();
  for (const char* part : {"corners", "z_min_m", "another zone", "zones.yaml:3"})
    EXPECT_NE(said.find(part), std::string::npos) << part << " in " << said;
}

TEST(SiteConfig, NetworksSayWhatTheyNeed) {
  const auto problem = [](const std::string& dds) {
    const auto read = parse_site_config("dds: {" + dds + "}", "x");
    return read ? std::string() : read.error().text();
  };
  EXPECT_EQ(problem("network: container"), "");
  EXPECT_NE(problem("network: plant").find("'dds.interfaces' must list"), std::string::npos);
  EXPECT_NE(problem("network: plant, interfaces: []").find("'dds.servers' or peers"),
            std::string::npos);
  EXPECT_EQ(problem("network: plant, interfaces: [], peers: [a]"), "");
  EXPECT_EQ(problem("network: plant, interfaces: [], servers: ['a:11811']"), "");
  EXPECT_NE(problem("network: plant, interfaces: [], servers: [a]"), "");
  EXPECT_NE(
      problem("network: plant, interfaces: [], servers: ['a:11811'], security: s").find("peers"),
      std::string::npos);
  EXPECT_NE(problem("network: wan, peers: [a]").find("through a tunnel"), std::string::npos);
  EXPECT_NE(problem("tcp_port: 5100").find("is gone"), std::string::npos);
  EXPECT_NE(problem("network: lan").find("none of: local, container, plant"), std::string::npos);
  for (const char* wrong :
       {"lo", "eth0", "'::1'", "127.0.0.1/8", "127.1", "localhost", "''", "1.2.3"})
    EXPECT_NE(problem(std::string("interfaces: [") + wrong + "]").find("x:1: 'dds.interfaces'"),
              std::string::npos)
        << wrong;
  EXPECT_EQ(problem("interfaces: [127.0.0.1, 10.1.2.3]"), "");
  const auto container = parse_site_config("dds: {network: container}", "x");
  EXPECT_TRUE(container->dds.interfaces.empty());
  EXPECT_FALSE(container->dds.uses_shared_memory());
  const auto local = parse_site_config("{}", "x");
  EXPECT_EQ(local->dds.interfaces, std::vector<std::string>{"127.0.0.1"});
  EXPECT_TRUE(local->dds.uses_shared_memory());
}

TEST(SiteConfig, DirectionOffsetAndSpeedOfRangefindersAreReadAndChecked) {
  const auto good = parse_site_config(
      "mapper: {cart_direction: -1, cart_offset_m: 60, trolley_offset_m: -0.5, "
      "largest_speed_mps: 1.5, rangefinder_noise_m: 0.01}\n",
      "site");
  ASSERT_TRUE(good) << good.error().text();
  EXPECT_EQ(good->mapper.cart_direction, -1);
  EXPECT_EQ(good->mapper.trolley_direction, 1);
  EXPECT_EQ(good->mapper.cart_offset_m, 60);
  EXPECT_EQ(good->mapper.largest_speed_mps, 1.5);
  const auto again = parse_site_config(to_yaml(*good), "again");
  ASSERT_TRUE(again) << again.error().text();
  EXPECT_EQ(to_yaml(*again), to_yaml(*good));
  for (const char* bad : {"cart_direction: 0", "trolley_direction: 2", "largest_speed_mps: 0",
                          "cart_offset_m: x", "rangefinder_noise_m: -1"})
    EXPECT_FALSE(parse_site_config(std::string("mapper: {") + bad + "}\n", "site")) << bad;
}

TEST(SiteConfig, ALiveCameraIsReadWrittenAndCheckedAgainstItsSource) {
  const auto config = parse_site_config(
      "camera: {source: v4l2, path: /dev/v4l/by-id/zed, layout: y8i, swap: true, width: 640, "
      "height: 480, rate_hz: 30, exposure_100us: 80, gain: 3, brightness: 110, latency_ms: 4}\n",
      "test");
  ASSERT_TRUE(config) << config.error().text();
  const auto again = parse_site_config(to_yaml(*config), "again");
  ASSERT_TRUE(again) << again.error().text();
  EXPECT_EQ(to_yaml(*again), to_yaml(*config));
  EXPECT_EQ(again->camera.source, CameraConfig::Source::kV4l2);
  EXPECT_EQ(again->camera.layout, CameraConfig::Layout::kY8i);
  for (const char* wrong :
       {"{source: folder}", "{source: v4l2}", "{path: /x}", "{source: webcam, path: /x}",
        "{source: v4l2, path: /x, remove: true}", "{source: v4l2, path: /x, width: 0}",
        "{source: v4l2, path: /x, layout: mono}", "{source: v4l2, path: /x, brightness: 110}"})
    EXPECT_FALSE(parse_site_config(std::string("camera: ") + wrong + "\n", "test")) << wrong;
}

}  // namespace
}  // namespace crane
