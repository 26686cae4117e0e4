// SPDX-License-Identifier: Apache-2.0
#include "gateway/foxglove_schemas.hpp"

#include <utility>

namespace crane::gateway {
namespace {

using Members = std::vector<std::pair<const char*, Json>>;

Json whole() {
  return {{"type", "integer"}, {"minimum", 0}};
}
Json real() {
  return {{"type", "number"}};
}
Json text() {
  return {{"type", "string"}};
}
Json bytes() {
  return {{"type", "string"}, {"contentEncoding", "base64"}};
}
Json list_of(Json item) {
  return {{"type", "array"}, {"items", std::move(item)}};
}

/// All of its members are needed.
Json object(const std::string& title, const Members& members) {
  Json out{{"title", "foxglove." + title}, {"type", "object"}};
  for (const auto& [name, schema] : members) {
    out["properties"][name] = schema;
    out["required"].push_back(name);
  }
  return out;
}

Json choice(const std::string& title, const std::vector<const char*>& names) {
  Json out{{"title", "foxglove." + title}};
  for (std::size_t i = 0; i < names.size(); ++i)
    out["oneOf"].push_back({{"title", names[i]}, {"const", i}});
  return out;
}

Json time() {
  Json nsec = whole();
  nsec["maximum"] = 999'999'999;
  return {
      {"type", "object"}, {"title", "time"}, {"properties", {{"sec", whole()}, {"nsec", nsec}}}};
}
Json vector2() {
  return object("Vector2", {{"x", real()}, {"y", real()}});
}
Json vector3() {
  return object("Vector3", {{"x", real()}, {"y", real()}, {"z", real()}});
}
Json quaternion() {
  return object("Quaternion", {{"x", real()}, {"y", real()}, {"z", real()}, {"w", real()}});
}
Json pose() {
  return object("Pose", {{"position", vector3()}, {"orientation", quaternion()}});
}
Json fields() {
  const Json type = choice("NumericType", {"UNKNOWN", "UINT8", "INT8", "UINT16", "INT16", "UINT32",
                                           "INT32", "FLOAT32", "FLOAT64"});
  return list_of(
      object("PackedElementField", {{"name", text()}, {"offset", whole()}, {"type", type}}));
}

Json schema_of(Channel channel) {
  switch (channel) {
    case Channel::kTransforms:
      return object(
          "FrameTransforms",
          {{"transforms", list_of(object("FrameTransform", {{"timestamp", time()},
                                                            {"parent_frame_id", text()},
                                                            {"child_frame_id", text()},
                                                            {"translation", vector3()},
                                                            {"rotation", quaternion()}}))}});
    case Channel::kLog:
      return object(
          "Log",
          {{"timestamp", time()},
           {"level", choice("LogLevel", {"UNKNOWN", "DEBUG", "INFO", "WARNING", "ERROR", "FATAL"})},
           {"message", text()},
           {"name", text()},
           {"file", text()},
           {"line", whole()}});
    case Channel::kHeights:
      return object("Grid", {{"timestamp", time()},
                             {"frame_id", text()},
                             {"pose", pose()},
                             {"column_count", whole()},
                             {"cell_size", vector2()},
                             {"row_stride", whole()},
                             {"cell_stride", whole()},
                             {"fields", fields()},
                             {"data", bytes()}});
    case Channel::kVoxels:
      return object("VoxelGrid", {{"timestamp", time()},
                                  {"frame_id", text()},
                                  {"pose", pose()},
                                  {"row_count", whole()},
                                  {"column_count", whole()},
                                  {"cell_size", vector3()},
                                  {"slice_stride", whole()},
                                  {"row_stride", whole()},
                                  {"cell_stride", whole()},
                                  {"fields", fields()},
                                  {"data", bytes()}});
    case Channel::kCloud:
      return object("PointCloud", {{"timestamp", time()},
                                   {"frame_id", text()},
                                   {"pose", pose()},
                                   {"point_stride", whole()},
                                   {"fields", fields()},
                                   {"data", bytes()}});
    case Channel::kImage:
      break;
  }
  return object(
      "CompressedImage",
      {{"timestamp", time()}, {"frame_id", text()}, {"data", bytes()}, {"format", text()}});
}

constexpr std::array<const char*, kChannels> kTopics = {"/tf",     "/log",   "/heights",
                                                        "/voxels", "/cloud", "/camera/left"};

}  // namespace

Json foxglove_advertisement() {
  Json channels = Json::array();
  for (std::size_t i = 0; i < kChannels; ++i) {
    const Json schema = schema_of(static_cast<Channel>(i));
    channels.push_back({{"id", i + 1},
                        {"topic", kTopics[i]},
                        {"encoding", "json"},
                        {"schemaName", schema["title"]},
                        {"schemaEncoding", "jsonschema"},
                        {"schema", schema.dump()}});
  }
  return {{"op", "advertise"}, {"channels", std::move(channels)}};
}

}  // namespace crane::gateway
