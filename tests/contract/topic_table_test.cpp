// SPDX-License-Identifier: Apache-2.0
// idl/README.md, the IDL and dds/topics.hpp say the same.

#include <gtest/gtest.h>

#include <fastdds/dds/topic/TopicDataType.hpp>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <sstream>
#include <string>

#include "clearance_replyPubSubTypes.h"
#include "clearance_requestPubSubTypes.h"
#include "dds/topics.hpp"
#include "height_tilePubSubTypes.h"
#include "hoist_statePubSubTypes.h"
#include "map_statusPubSubTypes.h"
#include "map_tilePubSubTypes.h"
#include "octree_mapPubSubTypes.h"
#include "partial_cloudPubSubTypes.h"
#include "rangefinder_positionPubSubTypes.h"
#include "service_statusPubSubTypes.h"
#include "stereo_framePubSubTypes.h"
#include "tile_requestPubSubTypes.h"
#include "zone_commandPubSubTypes.h"
#include "zone_setPubSubTypes.h"

namespace crane::dds {
namespace {

namespace fs = std::filesystem;

std::string read(const fs::path& path) {
  std::ifstream file(path);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

const fs::path kIdl = CRANEMAP_SOURCE_DIR "/idl";

/// How the table of idl/README.md writes a QoS.
std::string words(const QosSpec& q) {
  std::string s = q.reliable ? "reliable" : "best effort";
  s += q.transient_local ? ", transient-local" : ", volatile";
  s += ", keep-last " + std::to_string(q.depth);
  if (q.deadline_ms > 0) s += ", deadline " + std::to_string(q.deadline_ms) + " ms";
  if (q.lifespan_ms > 0) s += ", lifespan " + std::to_string(q.lifespan_ms) + " ms";
  if (q.liveliness_ms > 0) s += ", liveliness " + std::to_string(q.liveliness_ms) + " ms";
  if (q.exclusive) s += ", exclusive ownership";
  if (q.zero_copy) s += ", zero-copy";
  return s;
}

/// Rows of the topic table: topic name to the cells of its row.
std::map<std::string, std::vector<std::string>> table() {
  std::map<std::string, std::vector<std::string>> rows;
  std::istringstream text(read(kIdl / "README.md"));
  for (std::string line; std::getline(text, line);) {
    if (!line.starts_with("| `crane/v1/")) continue;
    std::vector<std::string> cells;
    std::istringstream row(line.substr(2));
    for (std::string cell; std::getline(row, cell, '|');) {
      const auto first = cell.find_first_not_of(" `");
      const auto last = cell.find_last_not_of(" `");
      cells.push_back(first == std::string::npos ? "" : cell.substr(first, last - first + 1));
    }
    rows[cells.at(0)] = cells;
  }
  return rows;
}

template <class PubSubType>
std::string registered_name() {
  PubSubType type;
  return type.getName();
}

template <class Topic, class PubSubType>
void check_row(std::size_t& seen) {
  const auto rows = table();
  const auto row = rows.find(Topic::kName);
  ASSERT_NE(row, rows.end()) << Topic::kName << " is not in idl/README.md";
  ++seen;
  EXPECT_EQ(row->second.at(1), registered_name<PubSubType>()) << Topic::kName;
  EXPECT_EQ(row->second.at(4), words(Topic::kQos)) << Topic::kName;
  const std::string name = std::string(Topic::kName).substr(std::string("crane/v1/").size());
  const std::string idl = read(kIdl / "v1" / (name + ".idl"));
  EXPECT_FALSE(idl.empty()) << name << ".idl";
  // Key fields as in the table.
  std::string keys;
  static const std::regex kKey(R"(@key\s+\w+\s+(\w+))");
  for (std::sregex_iterator it(idl.begin(), idl.end(), kKey), end; it != end; ++it)
    keys += (keys.empty() ? "" : ", ") + (*it)[1].str();
  EXPECT_EQ(row->second.at(2), keys.empty() ? "none" : keys) << Topic::kName;
  PubSubType type;
  EXPECT_EQ(type.m_isGetKeyDefined, !keys.empty()) << Topic::kName;
  if (Topic::kQos.zero_copy)
    EXPECT_TRUE(kInPlace<typename Topic::Type> && type.is_bounded() && keys.empty())
        << Topic::kName << ": zero-copy needs images where the payload has them, and no key";
}

TEST(TopicTable, ReadmeIdlAndCodeAgree) {
  std::size_t seen = 0;
  check_row<StereoFrameTopic, v1::StereoFramePubSubType>(seen);
  check_row<RangefinderPositionTopic, v1::RangefinderPositionPubSubType>(seen);
  check_row<HoistStateTopic, v1::HoistStatePubSubType>(seen);
  check_row<PartialCloudTopic, v1::PartialCloudPubSubType>(seen);
  check_row<MapTileTopic, v1::MapTilePubSubType>(seen);
  check_row<HeightTileTopic, v1::HeightTilePubSubType>(seen);
  check_row<OctreeMapTopic, v1::OctreeMapPubSubType>(seen);
  check_row<MapStatusTopic, v1::MapStatusPubSubType>(seen);
  check_row<TileRequestTopic, v1::TileRequestPubSubType>(seen);
  check_row<ZoneSetTopic, v1::ZoneSetPubSubType>(seen);
  check_row<ZoneCommandTopic, v1::ZoneCommandPubSubType>(seen);
  check_row<ClearanceRequestTopic, v1::ClearanceRequestPubSubType>(seen);
  check_row<ClearanceReplyTopic, v1::ClearanceReplyPubSubType>(seen);
  check_row<ServiceStatusTopic, v1::ServiceStatusPubSubType>(seen);
  EXPECT_EQ(seen, std::tuple_size_v<AllTopics>);
  EXPECT_EQ(table().size(), seen) << "idl/README.md names a topic that the code does not have";
}

TEST(Idl, EveryStructIsFinalAndEverythingIsBounded) {
  std::size_t structs = 0;
  for (const auto& entry : fs::directory_iterator(kIdl / "v1")) {
    const std::string idl = read(entry.path());
    static const std::regex kStruct(R"(\bstruct\s)"), kFinal(R"(@final\s+struct\s)");
    static const std::regex kUnbounded(R"(sequence<[^,>]+>|\bstring\s|\bwstring|\benum\s)");
    const auto count = [&idl](const std::regex& r) {
      return std::distance(std::sregex_iterator(idl.begin(), idl.end(), r), std::sregex_iterator());
    };
    EXPECT_EQ(count(kStruct), count(kFinal)) << entry.path();
    EXPECT_EQ(count(kUnbounded), 0) << entry.path();
    structs += std::size_t(count(kStruct));
  }
  EXPECT_GE(structs, std::tuple_size_v<AllTopics>);
}

TEST(Idl, EveryTopicTypeCarriesCraneAndSequenceOrRevision) {
  for (const auto& entry : fs::directory_iterator(kIdl / "v1")) {
    const std::string idl = read(entry.path());
    if (idl.find("struct") == std::string::npos) continue;
    EXPECT_NE(idl.find("uint32 crane;"), std::string::npos) << entry.path();
    EXPECT_TRUE(idl.find("sequence_number;") != std::string::npos ||
                idl.find("revision;") != std::string::npos)
        << entry.path();
    EXPECT_NE(idl.find("time_ns;"), std::string::npos) << entry.path();
  }
}

}  // namespace
}  // namespace crane::dds
