// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <functional>

#include "evaluation/evaluation.hpp"
#include "map_codec/octree_stream.hpp"
#include "temp_folder.hpp"

namespace crane {
namespace {

constexpr double kVoxel = 0.05;

TEST(MapJudge, CountsUnsafeMissedAndPhantomColumns) {
  HeightMap truth;
  truth.cell_m = 0.1;
  truth.columns = truth.rows = 20;
  truth.height_mm.assign(400, 0);
  for (int row = 8; row < 12; ++row)
    for (int column = 8; column < 12; ++column)
      truth.height_mm[std::size_t(row * 20 + column)] = 1000;
  std::vector<MapCube> map;
  for (int row = 0; row < 20; ++row)
    for (int column = 0; column < 20; ++column)
      map.push_back({column * 0.1 + 0.05, row * 0.1 + 0.05, 0.05, 0.1});
  Judgement flat = judge(map, 0.1, truth);
  EXPECT_EQ(flat.obstacle_columns, 16U);
  EXPECT_DOUBLE_EQ(flat.unsafe, 1.0);
  EXPECT_DOUBLE_EQ(flat.missed, 1.0);
  for (int row = 8; row < 12; ++row)
    for (int column = 8; column < 12; ++column)
      map.push_back({column * 0.1 + 0.05, row * 0.1 + 0.05, 0.95, 0.1});
  const Judgement right = judge(map, 0.1, truth);
  EXPECT_DOUBLE_EQ(right.unsafe, 0);
  EXPECT_DOUBLE_EQ(right.phantom, 0);
  map.push_back({0.25, 0.25, 1.55, 0.1});
  EXPECT_GT(judge(map, 0.1, truth).phantom, 0);
}

/// Four metres square of floor in cells of a centimetre, and what stands on it.
TrueSolids flat_truth(std::vector<TrueObstacle> obstacles = {}) {
  HeightMap h;
  h.cell_m = 0.01;
  h.columns = h.rows = 400;
  h.height_mm.assign(std::size_t(h.columns) * h.rows, 0);
  for (const TrueObstacle& o : obstacles)
    for (std::size_t cell = 0; cell < h.height_mm.size(); ++cell)
      if (std::abs(h.x_m(cell) - o.x_m) < o.size_x_m / 2 &&
          std::abs(h.y_m(cell) - o.y_m) < o.size_y_m / 2)
        h.height_mm[cell] = static_cast<std::uint16_t>(std::lround(o.height_m * 1000));
  return make_solids(h, std::move(obstacles));
}

TrueObstacle box(const std::string& name, double x, double y, double size_x, double size_y,
                 double height, double base = 0) {
  TrueObstacle o;
  o.name = name;
  o.kind = "box";
  o.x_m = x, o.y_m = y, o.size_x_m = size_x, o.size_y_m = size_y;
  o.height_m = height;
  o.base_m = base;
  return o;
}

/// A map up to 2 m, each voxel as a function of its middle says.
JudgedMap map_of(const std::function<Occupancy(double, double, double)>& what) {
  OctomapFile file;
  file.voxel_m = kVoxel;
  for (int z = -1; z < 40; ++z)
    for (int y = 0; y < 80; ++y)
      for (int x = 0; x < 80; ++x) {
        const MapCube cube{(x + 0.5) * kVoxel, (y + 0.5) * kVoxel, (z + 0.5) * kVoxel, kVoxel};
        const Occupancy is = what(cube.x_m, cube.y_m, cube.z_m);
        if (is == Occupancy::kOccupied) file.occupied.push_back(cube);
        if (is == Occupancy::kFree) file.free.push_back(cube);
      }
  auto map = JudgedMap::from_file(file, flat_truth().heights);
  EXPECT_TRUE(map) << map.error().text();
  return *std::move(map);
}

/// Floor occupied, everything above it free.
Occupancy empty_hall(double, double, double z) {
  return z < 0 ? Occupancy::kOccupied : Occupancy::kFree;
}

bool over(const TrueObstacle& o, double x, double y) {
  return std::abs(x - o.x_m) < o.size_x_m / 2 && std::abs(y - o.y_m) < o.size_y_m / 2;
}

TEST(CellJudge, AThinRailThatTheMapDoesNotShowIsLowAndCleared) {
  const TrueObstacle rail = box("rail", 2.02, 2, 0.04, 3, 1.1, 1.06);
  const CellJudgement j = judge_cells(map_of(empty_hall), flat_truth({rail}));
  EXPECT_EQ(j.all.solid, 4U * 300);
  EXPECT_EQ(j.all.low, j.all.solid);
  EXPECT_EQ(j.all.cleared, j.all.solid);
  EXPECT_EQ(j.all.found, 0U);
  EXPECT_EQ(j.cleared_spots, 1U);
  EXPECT_NEAR(j.worst_m, 1.1, 1e-9);
  // Columns of the voxel size leave it out: no column is all rail.
  EXPECT_EQ(judge(map_of(empty_hall).occupied(), kVoxel, flat_truth({rail}).heights).unsafe, 0);
}

TEST(CellJudge, WhatIsNotFreeIsUnknownAndHurtsNobody) {
  const TrueObstacle rail = box("rail", 2.02, 2, 0.04, 3, 1.1, 1.06);
  const CellJudgement j = judge_cells(
      map_of([&](double x, double y, double z) {
        return std::abs(x - 2.02) < 0.1 && z > 0 ? Occupancy::kUnknown : empty_hall(x, y, z);
      }),
      flat_truth({rail}));
  EXPECT_EQ(j.all.unknown, j.all.solid);
  EXPECT_EQ(j.all.cleared, 0U);
}

TEST(CellJudge, CountsEachObstacleAndWhatBelongsToNone) {
  const TrueObstacle found = box("found", 1, 1, 0.5, 0.5, 1),
                     lost = box("lost", 3, 3, 0.5, 0.5, 0.6);
  TrueSolids truth = flat_truth({found, lost});
  truth.heights.height_mm[200 * 400 + 50] = 500;  // a post that nobody listed
  truth = make_solids(truth.heights, truth.obstacles);
  const CellJudgement j =
      judge_cells(map_of([&](double x, double y, double z) {
                    if (!over(found, x, y) || z > 1) return empty_hall(x, y, z);
                    return z > 0.95 ? Occupancy::kOccupied : Occupancy::kUnknown;
                  }),
                  truth);
  ASSERT_EQ(j.obstacles.size(), 3U);
  EXPECT_EQ(j.obstacles[0].found, 2500U);
  EXPECT_EQ(j.obstacles[0].cleared + j.obstacles[0].hollow, 0U);
  EXPECT_EQ(j.obstacles[1].found, 0U);
  EXPECT_EQ(j.obstacles[1].cleared, 2500U);
  EXPECT_EQ(j.obstacles[2].name, "others");
  EXPECT_EQ(j.obstacles[2].solid, 1U);
  EXPECT_EQ(j.all.solid, 5001U);
}

TEST(CellJudge, FreeSpaceWithinABoxWhoseTopIsFoundIsHollow) {
  const TrueObstacle crate = box("crate", 2, 2, 1, 1, 1.2);
  const auto arrived = [&](double x, double y, double z) {
    return over(crate, x, y) && z > 1.15 && z < 1.2 ? Occupancy::kOccupied : empty_hall(x, y, z);
  };
  const CellJudgement j = judge_cells(map_of(arrived), flat_truth({crate}));
  EXPECT_EQ(j.all.found, j.all.solid);
  EXPECT_EQ(j.all.cleared, 0U);
  EXPECT_GT(j.all.hollow, 7000U) << "all but a rim of half the cube";
  // A tabletop is hollow below by right.
  const CellJudgement table =
      judge_cells(map_of(arrived), flat_truth({box("table", 2, 2, 1, 1, 1.2, 1.15)}));
  EXPECT_EQ(table.all.hollow, 0U);
}

TEST(CellJudge, MarksThePhantomsWhereTheyAre) {
  const CellJudgement j = judge_cells(map_of([](double x, double y, double z) {
                                        return std::hypot(x - 1.025, y - 3.025, z - 1) < 0.04
                                                   ? Occupancy::kOccupied
                                                   : empty_hall(x, y, z);
                                      }),
                                      flat_truth());
  std::size_t marked = 0;
  for (std::size_t i = 0; i < j.phantom.size(); ++i) marked += j.phantom[i];
  EXPECT_EQ(marked, 25U);
  EXPECT_EQ(j.phantom[302 * 400 + 102], 1);
}

TEST(ClearanceTrial, CountsNoWrongClearOfATrueMapAndManyOfAnEmptyOne) {
  const TrueObstacle crate = box("crate", 2, 2, 1, 1, 1.2),
                     rail = box("rail", 3.5, 2, 0.04, 3, 0.9, 0.86);
  const TrueSolids truth = flat_truth({crate, rail});
  const JudgedMap right = map_of([&](double x, double y, double z) {
    if (over(crate, x, y) && z < 1.2) return Occupancy::kOccupied;
    if (std::abs(x - rail.x_m) < 0.05 && over(box("", 3.5, 2, 1, 3, 0), x, y) && z < 0.9)
      return Occupancy::kOccupied;
    return empty_hall(x, y, z);
  });
  const ClearanceTrial good = try_clearance(truth, kVoxel, ask(right), {5000, 3});
  EXPECT_EQ(good.queries, 5000U);
  EXPECT_EQ(good.wrong_clear, 0U);
  EXPECT_GT(good.clear, 300U) << "a map that always blocks would pass as well";
  EXPECT_GT(good.blocked, 300U);
  const ClearanceTrial bad = try_clearance(truth, kVoxel, ask(map_of(empty_hall)), {5000, 3});
  EXPECT_GT(bad.wrong_clear, 500U);
  EXPECT_GT(bad.first_true_m, 0.8);
  const std::int64_t hit = cell_hit(truth, bad.first);
  ASSERT_GE(hit, 0);
  EXPECT_EQ(truth.heights.x_m(std::size_t(hit)), bad.first_x_m);
  // The same seed asks the same.
  EXPECT_EQ(try_clearance(truth, kVoxel, ask(right), {5000, 3}).clear, good.clear);
}

TEST(ClearanceTrial, AMarginThatIsAskedForIsKeptFromWhatIsMapped) {
  const TrueObstacle crate = box("crate", 2, 2, 1, 1, 1.2);
  const TrueSolids truth = flat_truth({crate});
  std::vector<double> margins;
  const Ask listen = [&](const client::ClearanceQuery& q) {
    margins.push_back(q.margins.horizontal_m);
    return client::Clearance{};
  };
  const ClearanceTrial t = try_clearance(truth, kVoxel, listen, {3, 1});
  EXPECT_EQ(t.invalid, 3U);
  (void)try_clearance(truth, kVoxel, listen, {2, 1, 0.3});
  EXPECT_EQ(margins, (std::vector<double>{kVoxel, kVoxel, kVoxel, 0.3, 0.3}));
}

TEST(ClearanceTrial, ALoadWithinABoxIsHitAndOneBelowABridgeIsNot) {
  const TrueSolids truth =
      flat_truth({box("crate", 1, 1, 1, 1, 1.2), box("bridge", 3, 3, 1, 0.3, 1.5, 1.4)});
  client::ClearanceQuery q;
  q.load.size_x_m = q.load.size_y_m = 0.2;
  q.load.size_z_m = 0.3;
  q.path = {{1, 1, 0.3, 0}};
  EXPECT_GE(cell_hit(truth, q), 0) << "inside";
  q.path = {{3, 3, 0.3, 0}};
  EXPECT_EQ(cell_hit(truth, q), -1) << "under the bridge";
  q.path = {{3, 3, 1.2, 0}};
  EXPECT_GE(cell_hit(truth, q), 0) << "into it";
  q.path = {{3, 3, 1.51, 0}};
  EXPECT_EQ(cell_hit(truth, q), -1) << "above it";
  q.path = {{2, 3, 1.3, 0}, {4, 3, 1.3, 0}};
  EXPECT_GE(cell_hit(truth, q), 0) << "through it";
}

TEST(JudgedMap, OfAMapAndOfItsFileSaysTheSame) {
  OccupancyMap map(kVoxel, 1U << 28U);
  for (int i = 0; i < 60; ++i)
    for (int z = -1; z < 40; ++z) {
      Block& block = *map.block(map.tile({tile_of(i), 0}), tile_of(z));
      block.log_odds[static_cast<std::size_t>((in_tile(z) * 32 + 7) * 32 + in_tile(i))] =
          static_cast<std::int8_t>(z < i / 4 ? 27
                                   : z < 30  ? -13
                                             : 0);
    }
  const Bytes bytes = write_bt(map);
  const auto file = decode_octomap({bytes.begin(), bytes.end()}, "map.bt");
  ASSERT_TRUE(file) << file.error().text();
  const auto read = JudgedMap::from_file(*file, flat_truth().heights);
  ASSERT_TRUE(read);
  const JudgedMap held = JudgedMap::from_map(map);
  for (int i = -2; i < 64; ++i) {
    EXPECT_EQ(read->top_m(i, 7), held.top_m(i, 7));
    for (int z = -3; z < 44; ++z)
      for (int y : {6, 7}) {
        ASSERT_EQ(read->at(i, y, z), held.at(i, y, z));
        ASSERT_EQ(held.at(i, y, z), map.at(i, y, z));
      }
  }
}

// --- map files ---------------------------------------------------------------------------------

std::vector<std::uint8_t> file_of(const std::string& header,
                                  const std::vector<std::uint8_t>& nodes) {
  std::vector<std::uint8_t> out(header.begin(), header.end());
  out.insert(out.end(), nodes.begin(), nodes.end());
  return out;
}

std::string refusal(const std::vector<std::uint8_t>& file) {
  const auto read = decode_octomap(file, "map");
  return read ? "read" : read.error().text();
}

// A tree of small voxels, so that its two halves are small enough to be believed.
const std::string kBt = "# Octomap OcTree binary file\nid OcTree\nsize 3\nres 0.002\ndata\n";
const std::vector<std::uint8_t> kTwoLeaves = {0x09, 0};  // an occupied and a free child

TEST(OctomapFile, IsReadWhenItHoldsWhatItDeclares) {
  const auto read = decode_octomap(file_of(kBt, kTwoLeaves), "map");
  ASSERT_TRUE(read) << read.error().text();
  EXPECT_EQ(read->occupied.size(), 1U);
  EXPECT_EQ(read->free.size(), 1U);
}

TEST(OctomapFile, IsRefusedAtEveryPlaceWhereItCanBeCut) {
  OccupancyMap map(kVoxel, 1U << 28U);
  Block& block = *map.block(map.tile({0, 0}), 0);
  for (std::size_t i = 0; i < kBlockVoxels; i += 37) block.log_odds[i] = i % 2 == 0 ? 27 : -13;
  for (const Bytes& whole : {write_bt(map), write_colour_ot(map)}) {
    ASSERT_TRUE(decode_octomap({whole.begin(), whole.end()}, "whole"));
    for (std::size_t size = 0; size < whole.size(); size += size < 200 ? 1 : 97)
      ASSERT_FALSE(decode_octomap({whole.begin(), whole.begin() + std::ptrdiff_t(size)}, "cut"))
          << size << " of " << whole.size();
    Bytes longer = whole;
    longer.push_back(0);
    EXPECT_NE(refusal({longer.begin(), longer.end()}).find("after its last node"),
              std::string::npos);
  }
}

TEST(OctomapFile, SaysWhatIsWrongWithADamagedOne) {
  const auto with = [](const std::string& from, const std::string& to) {
    std::string header = kBt;
    header.replace(header.find(from), from.size(), to);
    return refusal(file_of(header, kTwoLeaves));
  };
  EXPECT_NE(with("size 3", "size 1000000000").find("more than 50 million"), std::string::npos);
  EXPECT_NE(with("size 3", "size 9").find("declares 9 nodes and holds 3"), std::string::npos);
  EXPECT_NE(with("size 3", "size -3").find("size"), std::string::npos);
  EXPECT_NE(with("size 3\n", "").find("no id, size or res"), std::string::npos);
  for (const char* res : {"nan", "inf", "0", "-0.05", "1e300", "", "abc"})
    EXPECT_NE(with("res 0.002", std::string("res ") + res), "read") << res;
  EXPECT_NE(with("id OcTree", "id PetTree").find("known kind"), std::string::npos);
  EXPECT_NE(with("# Octomap", "# Octopus").find("no OctoMap file"), std::string::npos);
  EXPECT_NE(with("data\n", "").find("header"), std::string::npos);
  // Deeper than any tree: each node has one child with children.
  std::string header = kBt;
  header.replace(header.find("size 3"), 6, "size 41");
  std::vector<std::uint8_t> deep;
  for (int i = 0; i < 40; ++i) deep.insert(deep.end(), {3, 0});
  EXPECT_NE(refusal(file_of(header, deep)).find("deeper than 16"), std::string::npos);
}

TEST(OctomapFile, WholeSpaceBeingOneCubeIsNoMap) {
  EXPECT_NE(refusal(file_of("# Octomap OcTree binary file\nid OcTree\nsize 9\nres 0.05\ndata\n",
                            {0xAA, 0xAA}))
                .find("no map of a plant"),
            std::string::npos);
}

TEST(OctomapFile, ARefusedNodeValueIsNoNumber) {
  const std::string header = "# Octomap OcTree file\nid OcTree\nsize 1\nres 0.05\ndata\n";
  const float nan = std::nanf("");
  std::vector<std::uint8_t> node(5, 0);
  std::memcpy(node.data(), &nan, sizeof nan);
  EXPECT_NE(refusal(file_of(header, node)).find("no number"), std::string::npos);
}

TEST(JudgedMap, AFileOfGiganticOrTinyCubesCostsNoMoreThanTheTruthIsLarge) {
  OctomapFile file;
  file.voxel_m = kVoxel;
  file.free.push_back({0, 0, 0, kVoxel * 65'536});
  const auto map = JudgedMap::from_file(file, flat_truth().heights);
  ASSERT_TRUE(map);
  EXPECT_EQ(map->at(10, 10, 10), Occupancy::kFree);
  EXPECT_EQ(judge(file.free, kVoxel, flat_truth().heights).coverage, 1);
  file.voxel_m = 1e-4;
  file.free = {{0, 0, 0, 1e-4 * 65'536}};
  EXPECT_FALSE(JudgedMap::from_file(file, flat_truth().heights));
}

}  // namespace
}  // namespace crane
