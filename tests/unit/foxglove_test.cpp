// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <openssl/evp.h>

#include <cmath>
#include <cstring>

#include "bounds.h"
#include "gateway/foxglove_feed.hpp"
#include "gateway/foxglove_messages.hpp"
#include "gateway/json.hpp"

namespace crane::gateway {
namespace {

class FoxgloveProtocol : public testing::Test {
 protected:
  FoxgloveProtocol() {
    EXPECT_EQ(json(feed.next())["op"], "serverInfo");
    EXPECT_EQ(json(feed.next())["op"], "advertise");
  }
  static Json json(const std::optional<http::Message>& message) {
    return message && !message->binary ? Json::parse(message->bytes) : Json();
  }
  bool subscribe(std::uint32_t id, Channel channel) {
    return feed.hear(R"({"op":"subscribe","subscriptions":[{"id":)" + std::to_string(id) +
                     R"(,"channelId":)" + std::to_string(int(channel) + 1) + "}]}");
  }
  /// Subscription and payload of the next message.
  std::pair<std::uint32_t, std::string> data() {
    const auto message = feed.next();
    if (!message) return {0, "nothing"};
    if (!message->binary || message->bytes[0] != 1) return {0, message->bytes};
    std::uint32_t id = 0;
    std::memcpy(&id, message->bytes.data() + 1, 4);
    return {id, message->bytes.substr(13)};
  }

  TimeNs now = 0;
  FoxgloveChannels channels;
  FoxgloveFeed feed{channels, "test", [this] { return now; }};
};

using Pair = std::pair<std::uint32_t, std::string>;

TEST_F(FoxgloveProtocol, TellsOnlyWhatIsNewestOfWhatIsSubscribed) {
  ASSERT_TRUE(subscribe(7, Channel::kCloud));
  EXPECT_EQ(data(), Pair(0, "nothing"));
  for (const char* one : {"a", "b", "c"}) channels.put(Channel::kCloud, 5, one);
  channels.put(Channel::kHeights, 5, "not asked for");
  EXPECT_EQ(data(), Pair(7, "c"));
  EXPECT_EQ(data(), Pair(0, "nothing"));
}

TEST_F(FoxgloveProtocol, TellsTransformsAndLogInOrderAndKeepsABoundedNumber) {
  for (int i = 1; i <= 200; ++i) channels.put(Channel::kLog, i, std::to_string(i));
  ASSERT_TRUE(subscribe(0, Channel::kLog));
  EXPECT_EQ(data(), Pair(0, "137"));
  for (int i = 138; i <= 200; ++i) EXPECT_EQ(data().second, std::to_string(i));
  EXPECT_EQ(data().second, "nothing");
}

TEST_F(FoxgloveProtocol, EachChannelHasItsTurn) {
  ASSERT_TRUE(subscribe(1, Channel::kCloud) && subscribe(2, Channel::kLog));
  channels.put(Channel::kLog, 1, "log");
  for (int i = 0; i < 3; ++i) {
    channels.put(Channel::kCloud, 1, "cloud");
    const auto one = data(), two = data();
    if (i == 0) EXPECT_NE(one.first, two.first) << "a busy channel keeps no other waiting";
  }
}

TEST_F(FoxgloveProtocol, WhatNobodyWantsIsForgotten) {
  EXPECT_FALSE(channels.wanted(Channel::kCloud));
  ASSERT_TRUE(subscribe(1, Channel::kCloud) && subscribe(2, Channel::kCloud));
  channels.put(Channel::kCloud, 1, "old");
  ASSERT_TRUE(feed.hear(R"({"op":"unsubscribe","subscriptionIds":[1]})"));
  EXPECT_TRUE(channels.wanted(Channel::kCloud));
  {
    FoxgloveFeed other(channels, "other", [] { return 0; });
    other.hear(R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":3}]})");
    EXPECT_TRUE(channels.wanted(Channel::kHeights));
  }
  EXPECT_FALSE(channels.wanted(Channel::kHeights)) << "it has gone";
  ASSERT_TRUE(feed.hear(R"({"op":"unsubscribe","subscriptionIds":[2]})"));
  EXPECT_FALSE(channels.wanted(Channel::kCloud));
  ASSERT_TRUE(subscribe(3, Channel::kCloud));
  EXPECT_EQ(data().second, "nothing") << "what is old is not told as new";
}

TEST_F(FoxgloveProtocol, SubscriptionsAreBoundedAndWhatIsWrongIsSaid) {
  for (std::uint32_t id = 0; id < FoxgloveFeed::kMostSubscriptions + 5; ++id)
    EXPECT_TRUE(subscribe(id, Channel::kLog));
  EXPECT_EQ(feed.subscriptions(), FoxgloveFeed::kMostSubscriptions);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(json(feed.next())["op"], "status");
  EXPECT_TRUE(feed.hear(R"({"op":"advertise","channels":[]})"));
  EXPECT_NE(std::string(json(feed.next())["message"]).find("read only"), std::string::npos);
  EXPECT_TRUE(feed.hear(R"({"op":"unsubscribe","subscriptionIds":[4294967296]})"));
  EXPECT_EQ(json(feed.next())["level"], 2);
}

TEST_F(FoxgloveProtocol, WhoFloodsIsCutOffWhoTalksAtTimesIsNot) {
  int heard = 0;
  while (heard < 1000 && subscribe(1, Channel::kLog)) ++heard;
  EXPECT_EQ(heard, 100);
  now += 2 * kNsPerSecond;
  EXPECT_TRUE(subscribe(1, Channel::kLog));
  for (int i = 0; i < 1000; ++i) {
    now += kNsPerSecond / 5;
    ASSERT_TRUE(subscribe(1, Channel::kLog));
  }
}

std::string bytes_of(const Json& message) {
  const std::string text = message["data"];
  std::string out(text.size() / 4 * 3, '\0');
  EVP_DecodeBlock(reinterpret_cast<unsigned char*>(out.data()),
                  reinterpret_cast<const unsigned char*>(text.data()), int(text.size()));
  for (std::size_t i = text.size(); i > 0 && text[i - 1] == '='; --i) out.pop_back();
  return out;
}
float real(const std::string& bytes, std::size_t at) {
  float value = 0;
  std::memcpy(&value, bytes.data() + at, 4);
  return value;
}

TEST(FoxgloveCloud, IsInTheCamerasFrameWithoutWhatIsNoEvidence) {
  dds::PartialCloud c;
  c.width(2);
  c.height(2);
  c.f_px(100);
  c.cx_px(0);
  c.cy_px(0);
  c.has_colour(1);
  c.rotation() = {0, -1, 0, 1, 0, 0, 0, 0, 1};  // rectified x is the camera's y
  c.depth().resize(4);
  c.confidence().resize(4);
  c.colour().resize(12);
  for (std::size_t i = 0; i < 4; ++i) c.depth()[i] = std::array{0.F, 2.F, -3.F, NAN}[i];
  c.confidence()[1] = 200;
  for (std::size_t i = 0; i < 3; ++i) c.colour()[3 + i] = std::uint8_t(10 + i);
  const Json message = Json::parse(foxglove::point_cloud(c, 100));
  const std::string data = bytes_of(message);
  ASSERT_EQ(data.size(), 17U) << "one point is evidence";
  EXPECT_FLOAT_EQ(real(data, 0), 0);
  EXPECT_FLOAT_EQ(real(data, 4), 0.02F);
  EXPECT_FLOAT_EQ(real(data, 8), 2);
  EXPECT_EQ(data.substr(12), "\xC8\x0C\x0B\x0A\xFF") << "confidence, red, green, blue, alpha";
  EXPECT_EQ(message["frame_id"], "camera");
}

TEST(FoxgloveCloud, IsBounded) {
  dds::PartialCloud c;
  c.width(101);
  c.height(73);
  c.f_px(100);
  c.depth().resize(101 * 73);
  c.confidence().resize(101 * 73);
  for (std::size_t i = 0; i < 101 * 73; ++i) c.depth()[i] = 1;
  for (const std::size_t most : {1UL, 10UL, 1000UL, 7372UL, 8000UL}) {
    const std::size_t points = bytes_of(Json::parse(foxglove::point_cloud(c, most))).size() / 13;
    EXPECT_LE(points, most);
    EXPECT_GE(points, std::min<std::size_t>(most, 7373) / 5) << most;
  }
}

client::HeightGrid grid_of(std::uint32_t columns, const std::vector<double>& heights) {
  client::HeightGrid g;
  g.cell_m = 0.5;
  g.origin_x_m = 1;
  g.columns = columns;
  g.rows = std::uint32_t(heights.size()) / columns;
  for (const double h : heights) {
    client::Height cell;
    cell.surface = std::isnan(h) ? client::Surface::kUnknown : client::Surface::kObstacle;
    cell.height_m = h;
    g.cells.push_back(cell);
  }
  return g;
}

TEST(FoxgloveGrid, CellsThatArePutTogetherHideNothing) {
  const auto g = grid_of(3, {1, 2, 5, 3, NAN, NAN, NAN, NAN, NAN});
  const Json whole = Json::parse(foxglove::grid(g, 1, 9));
  EXPECT_EQ(whole["column_count"], 3);
  EXPECT_FLOAT_EQ(real(bytes_of(whole), 6), 2);
  EXPECT_TRUE(std::isnan(real(bytes_of(whole), 4 * 6)));
  const Json coarse = Json::parse(foxglove::grid(g, 1, 4));
  const std::string data = bytes_of(coarse);
  EXPECT_EQ(coarse["column_count"], 2);
  EXPECT_EQ(coarse["cell_size"]["x"], 1.0);
  ASSERT_EQ(data.size(), 4 * 6U);
  EXPECT_FLOAT_EQ(real(data, 0), 3) << "the highest";
  EXPECT_EQ(data[5], 1) << "and may be higher where it is unknown";
  EXPECT_FLOAT_EQ(real(data, 6), 5);
  EXPECT_TRUE(std::isnan(real(data, 12)));
  EXPECT_EQ(data[12 + 5], 0) << "no height, no lower bound";
}

TEST(FoxgloveVoxels, AreFreeOnlyWhereAllIsFree) {
  OctomapFile map;
  map.voxel_m = 0.1;
  const auto voxel = [](int x, int y, int z) {
    return MapCube{0.1 * x + 0.05, 0.1 * y + 0.05, 0.1 * z + 0.05, 0.1};
  };
  map.occupied = {voxel(-1, 0, 0)};
  map.free = {{0.1, 0.1, 0.1, 0.2}, voxel(2, 0, 0)};  // a cube of 2 x 2 x 2
  const auto fine = foxglove::voxel_grid(map, 1, 1000);
  ASSERT_TRUE(fine);
  const Json message = Json::parse(*fine);
  EXPECT_EQ(message["column_count"], 4);
  EXPECT_EQ(message["row_count"], 2);
  EXPECT_DOUBLE_EQ(message["pose"]["position"]["x"], -0.1);
  EXPECT_EQ(bytes_of(message), std::string("\2\1\1\1\0\1\1\0\0\1\1\0\0\1\1\0", 16));
  const auto coarse = foxglove::voxel_grid(map, 1, 2);
  ASSERT_TRUE(coarse);
  EXPECT_EQ(bytes_of(Json::parse(*coarse)), std::string("\2\0", 2))
      << "half free is not free; something in it is occupied";
  map.occupied.clear();
  EXPECT_FALSE(foxglove::voxel_grid(map, 1, 100));
}

TEST(FoxgloveImage, IsAJpegOrAnError) {
  dds::StereoFrame f;
  f.width(8);
  f.height(4);
  f.encoding(99);
  EXPECT_FALSE(foxglove::left_image(f, 640));
  f.encoding(v1::ENCODING_MONO8);
  f.left().resize(8 * 4);
  const auto made = foxglove::left_image(f, 4);
  ASSERT_TRUE(made) << made.error().text();
  EXPECT_TRUE(bytes_of(Json::parse(*made)).starts_with("\xFF\xD8\xFF"));
}

}  // namespace
}  // namespace crane::gateway
