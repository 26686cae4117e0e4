// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>

#include "gateway/height_files.hpp"
#include "gateway/json.hpp"
#include "gateway/map_feed.hpp"
#include "gateway/site_files.hpp"
#include "gateway/token.hpp"
#include "http/query.hpp"
#include "temp_folder.hpp"

namespace crane::gateway {
namespace {

client::Height obstacle(double height_m) {
  client::Height h;
  h.surface = client::Surface::kObstacle;
  h.height_m = height_m;
  h.views = 3;
  h.last_observed_ns = 1'700'000'000 * kNsPerSecond;
  return h;
}

std::vector<client::Height> tile_of(double height_m) {
  return std::vector<client::Height>(kTileEdge * kTileEdge, obstacle(height_m));
}

std::uint32_t word(const std::string& bytes, std::size_t at) {
  std::uint32_t value = 0;
  std::memcpy(&value, bytes.data() + at, 4);
  return value;
}

TEST(TileLog, SaysEachTileOnceAndOnlyWhatIsNewest) {
  TileLog log;
  log.put({0, 0}, "a1");
  log.put({1, 0}, "b1");
  log.put({0, 0}, "a2");
  const auto all = log.after(0, 0, 10);
  ASSERT_EQ(all.tiles.size(), 2U) << "a1 is nothing any more";
  EXPECT_EQ(*all.tiles[0], "b1");
  EXPECT_EQ(*all.tiles[1], "a2");
  EXPECT_TRUE(log.after(all.generation, all.until, 10).tiles.empty());
  log.put({1, 0}, "b2");
  const auto later = log.after(all.generation, all.until, 10);
  ASSERT_EQ(later.tiles.size(), 1U);
  EXPECT_EQ(*later.tiles[0], "b2");
  EXPECT_EQ(log.after(0, 0, 1).tiles.size(), 1U) << "no more than asked for";
}

TEST(TileLog, AnotherMapBeginsAnewForWhoeverFollowed) {
  TileLog log;
  log.put({0, 0}, "old");
  const auto before = log.after(0, 0, 10);
  log.begin_anew();
  log.put({5, 5}, "new");
  const auto after = log.after(before.generation, before.until, 10);
  EXPECT_NE(after.generation, before.generation);
  ASSERT_EQ(after.tiles.size(), 1U);
  EXPECT_EQ(*after.tiles[0], "new");
}

TEST(MapFeed, TellsTheNewestStateFirstAndThenTilesHoweverManyThereWere) {
  StateBoard board;
  TileLog tiles;
  MapFeed feed(board, tiles);
  tiles.put({0, 0}, encode_tile({0, 0}, tile_of(1)));
  EXPECT_FALSE(feed.next()) << "what the tiles are of is not known yet";
  for (int i = 0; i < 1000; ++i) board.put(std::to_string(i));
  for (int i = 0; i < 1000; ++i) tiles.put({i % 40, 0}, encode_tile({i % 40, 0}, tile_of(i)));
  const auto state = feed.next();
  ASSERT_TRUE(state && !state->binary);
  EXPECT_EQ(state->bytes, "999");
  std::size_t told = 0;
  while (const auto message = feed.next()) {
    ASSERT_TRUE(message->binary);
    EXPECT_EQ(word(message->bytes, 0), 0x31544D43U);
    const std::uint32_t count = word(message->bytes, 8);
    EXPECT_EQ(message->bytes.size(), 16 + count * (8 + 1024 * 10));
    told += count;
  }
  EXPECT_EQ(told, 40U);
}

TEST(EncodeTile, KeepsWhatACellIs) {
  auto columns = tile_of(1.25);
  columns[33].lower_bound = true;
  columns[34] = {};
  columns[35].surface = client::Surface::kStale;
  const std::string bytes = encode_tile({-3, 7}, columns);
  EXPECT_EQ(static_cast<std::int32_t>(word(bytes, 0)), -3);
  EXPECT_EQ(word(bytes, 4), 7U);
  const auto height = [&](std::size_t i) {
    float value = 0;
    std::memcpy(&value, bytes.data() + 8 + 4 * i, 4);
    return value;
  };
  EXPECT_EQ(height(0), 1.25F);
  EXPECT_TRUE(std::isnan(height(34))) << "no number without validity";
  EXPECT_TRUE(std::isnan(height(35)));
  EXPECT_EQ(word(bytes, 8 + 4096), 1'700'000'000U);
  const auto flags = [&](std::size_t i) { return int(bytes[8 + 8192 + i]); };
  EXPECT_EQ(flags(0), 2);
  EXPECT_EQ(flags(33), 6);
  EXPECT_EQ(flags(34), 0);
  EXPECT_EQ(flags(35), 3);
  EXPECT_EQ(int(bytes[8 + 9216]), 3);
}

TEST(ParseClearance, TakesAWholeQuestion) {
  const auto q = parse_clearance(
      R"({"path":[{"x_m":1,"y_m":2,"z_m":3},{"x_m":4,"y_m":5,"z_m":6,"yaw_rad":0.5}],)"
      R"("load":{"size_x_m":0.3,"above_m":0.2},"margins":{"braking_m":1},"max_age_s":9,)"
      R"("min_views":2})");
  ASSERT_TRUE(q) << q.error().text();
  ASSERT_EQ(q->path.size(), 2U);
  EXPECT_EQ(q->path[1].yaw_rad, 0.5);
  EXPECT_EQ(q->load.size_x_m, 0.3);
  EXPECT_EQ(q->load.above_m, 0.2);
  EXPECT_EQ(q->margins.braking_m, 1);
  EXPECT_EQ(q->margins.horizontal_m, 0.2) << "the library's default";
  EXPECT_EQ(q->max_age_s, 9);
  EXPECT_EQ(q->min_views, 2U);
  const auto least = parse_clearance(R"({"path":[{"x_m":1,"y_m":2,"z_m":3}]})");
  ASSERT_TRUE(least);
  EXPECT_EQ(least->load.above_m, client::kToRopeTop) << "what is left out leaves nothing out";
}

TEST(ParseClearance, RefusesTheRestAndNamesIt) {
  std::string many = R"({"path":[)";
  for (int i = 0; i < 257; ++i)
    many += std::string(i > 0 ? "," : "") + R"({"x_m":1,"y_m":2,"z_m":3})";
  const std::pair<std::string, const char*> cases[] = {
      {"", "no JSON"},
      {"[]", "must be an object"},
      {"{}", "path is missing"},
      {R"({"path":[]})", "list of poses"},
      {R"({"path":{}})", "list of poses"},
      {R"({"path":[1]})", "path[0] must be an object"},
      {R"({"path":[{"x_m":1,"y_m":2}]})", "path[0].z_m is missing"},
      {R"({"path":[{"x_m":"1","y_m":2,"z_m":3}]})", "path[0].x_m must be a number"},
      {R"({"path":[{"x_m":1e999,"y_m":2,"z_m":3}]})", "no JSON"},
      {R"({"path":[{"x_m":1,"y_m":2,"z_m":3,"w":4}]})", "path[0] has a key that is not known"},
      {R"({"path":[{"x_m":1,"y_m":2,"z_m":3}],"above":0})", "a key that is not known"},
      {R"({"path":[{"x_m":1,"y_m":2,"z_m":3}],"load":[]})", "load must be an object"},
      {R"({"path":[{"x_m":1,"y_m":2,"z_m":3}],"min_views":1.5})", "min_views"},
      {R"({"path":[{"x_m":1,"y_m":2,"z_m":3}],"min_views":-1})", "min_views"},
      {many + "]}", "more than 256"},
      {std::string(60'000, '['), "nested too deep"}};
  for (const auto& [body, what] : cases) {
    const auto q = parse_clearance(body);
    ASSERT_FALSE(q) << body.substr(0, 80);
    EXPECT_NE(q.error().what.find(what), std::string::npos)
        << body.substr(0, 80) << ": " << q.error().what;
  }
}

TEST(ToJson, SaysNoNumberWhereNothingIsKnown) {
  client::Height unknown;
  unknown.height_m = 1.5;
  EXPECT_TRUE(to_json(unknown, 0)["height_m"].is_null());
  EXPECT_TRUE(to_json(client::Clearance{})["safe_height_m"].is_null());
  EXPECT_EQ(to_json(client::Clearance{})["verdict"], "invalid");
  client::Zone zone;
  zone.name = "caf\xE9";  // no UTF-8
  EXPECT_NE(text_of(to_json(zone)).find("caf"), std::string::npos) << "replaced, not thrown";
}

TEST(Token, LetsThroughWhoShowsItAndNobodyElse) {
  const std::string token = "0123456789abcdef";
  http::Request r{"GET", "/", {}, ""};
  EXPECT_EQ(demand_token(r, token)->status, 401);
  r.target = "/?token=" + token;
  r.secure = true;
  EXPECT_TRUE(demand_token(r, token)->headers[1].second.ends_with("; Secure"));
  r.upgrade = true;
  EXPECT_FALSE(demand_token(r, token)) << "a viewer's WebSocket has nothing but its URL";
  r.target = "/?token=" + token + "x";
  EXPECT_TRUE(demand_token(r, token));
  r = http::Request{"GET", "/", {}, ""};
  r.authorization = "Bearer " + token;
  EXPECT_FALSE(demand_token(r, token));
  for (const char* wrong :
       {"Bearer ", "Bearer 0123456789abcdeX", "Bearer 0123456789abcdef0", "Bearer 0123456789abcde",
        "Basic 0123456789abcdef", "0123456789abcdef"}) {
    r.authorization = wrong;
    EXPECT_TRUE(demand_token(r, token)) << wrong;
  }
  r.authorization = "";
  r.cookie = "other=1; cranemap=" + token;
  EXPECT_FALSE(demand_token(r, token));
  r.cookie = "xcranemap=" + token;
  EXPECT_TRUE(demand_token(r, token));
  r.cookie = "";
  r.target = "//evil.example/?token=" + token;
  const auto answer = demand_token(r, token);
  EXPECT_EQ(answer->status, 303);
  EXPECT_EQ(answer->headers[0].second, "/") << "nobody is sent elsewhere";
  r.method = "POST";
  EXPECT_EQ(demand_token(r, token)->status, 401);
}

TEST(Token, IsReadFromAFileAndMustBeLong) {
  const test::TempFolder folder;
  std::ofstream(folder / "good") << "0123456789abcdef\nmore\n";
  std::ofstream(folder / "short") << "0123456789\n";
  std::ofstream(folder / "odd") << "0123456789 abcdef;\n";
  ASSERT_TRUE(read_token(folder / "good"));
  EXPECT_EQ(*read_token(folder / "good"), "0123456789abcdef");
  for (const char* bad : {"short", "odd", "none"})
    EXPECT_EQ(read_token(folder / bad).error().code, ErrorCode::kConfiguration) << bad;
}

TEST(SiteFiles, AreThoseOfTheFolderByTheirPaths) {
  const test::TempFolder folder;
  std::filesystem::create_directories(folder / "page/assets");
  std::ofstream(folder / "page/index.html") << "<html>";
  std::ofstream(folder / "page/assets/x.js") << "1";
  std::ofstream(folder / "secret") << "no";
  std::filesystem::create_symlink("../secret", folder / "page/assets/link");
  const auto files = read_site_files(folder / "page");
  ASSERT_TRUE(files) << files.error().text();
  EXPECT_EQ(files->at("/").body, "<html>");
  EXPECT_EQ(files->at("/assets/x.js").type, "text/javascript; charset=utf-8");
  EXPECT_FALSE(files->contains("/assets/../../secret"));
  EXPECT_EQ(read_site_files(folder / "none").error().code, ErrorCode::kNotAvailable);
}

TEST(HeightFiles, SayTheSameOfEachColumn) {
  client::HeightGrid grid;
  grid.cell_m = 0.5;
  grid.origin_x_m = -1;
  grid.origin_y_m = 2;
  grid.columns = 2;
  grid.rows = 2;
  grid.cells = {obstacle(1), {}, obstacle(2), obstacle(-0.1)};
  const TimeNs now = 1'700'000'010 * kNsPerSecond;
  const Json json = Json::parse(heights_json(grid, "{}", now));
  EXPECT_EQ(json["height_m"], Json::parse("[1.0, null, 2.0, -0.1]"));
  EXPECT_EQ(json["surface"], Json::parse("[2, 0, 2, 2]"));
  EXPECT_EQ(json["age_s"], Json::parse("[10, null, 10, 10]"));
  EXPECT_EQ(heights_csv(grid, now),
            "x_m,y_m,surface,height_m,lower_bound,views,age_s\n"
            "-0.7500,2.2500,obstacle,1.0000,0,3,10\n"
            "-0.7500,2.7500,obstacle,2.0000,0,3,10\n"
            "-0.2500,2.7500,obstacle,-0.1000,0,3,10\n");
  EXPECT_EQ(heights_world_file(grid),
            "0.500000\n0.000000\n0.000000\n-0.500000\n-0.750000\n2.750000\n");
  const auto png = heights_png(grid);
  ASSERT_TRUE(png) << png.error().text();
  EXPECT_EQ(png->substr(1, 3), "PNG");
  EXPECT_FALSE(heights_png({})) << "nothing to show";
}

TEST(ParseQuery, TakesNamesAndValuesAndRefusesWhatIsUnsound) {
  const auto q = http::parse_query("x=1.5&y=%2D2&name=a+b%20c&flag");
  ASSERT_TRUE(q);
  EXPECT_EQ(q->at("x"), "1.5");
  EXPECT_EQ(q->at("y"), "-2");
  EXPECT_EQ(q->at("name"), "a b c");
  EXPECT_EQ(q->at("flag"), "");
  for (const char* bad : {"x=%", "x=%2", "x=%zz", "x=%00", "x=1&x=2", "=1", "&", "x=\x01"})
    EXPECT_FALSE(http::parse_query(bad)) << bad;
  EXPECT_TRUE(http::parse_query("")->empty());
  EXPECT_EQ(http::parse_number("1e-3"), 1e-3);
  for (const char* bad : {"", " 1", "1 ", "1,5", "nan", "inf", "1e999", "0x10", "--1"})
    EXPECT_FALSE(http::parse_number(bad)) << bad;
}

}  // namespace
}  // namespace crane::gateway
