// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <string_view>

#include "map_codec/octomap_file.hpp"

namespace crane {
namespace {

constexpr int kLevels = 16;  ///< below the root, in every OctoMap tree
constexpr std::size_t kMaxHeader = 4096;
constexpr std::string_view kBinary = "# Octomap OcTree binary file";
constexpr std::string_view kFull = "# Octomap OcTree file";
constexpr double kFinest = 1e-4, kCoarsest = 100;  ///< voxels [m]

std::string_view word(std::string_view& rest) {
  const std::size_t from = std::min(rest.find_first_not_of(" \t\r"), rest.size());
  const std::size_t to = std::min(rest.find_first_of(" \t\r", from), rest.size());
  const std::string_view out = rest.substr(from, to - from);
  rest.remove_prefix(to);
  return out;
}

template <class T>
bool parse(std::string_view text, T& out) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out);
  return error == std::errc{} && end == text.data() + text.size();
}

/// Walks the nodes as OctoMap would read them. Recursion is as deep as the tree may be.
class NodeWalk {
 public:
  NodeWalk(std::span<const std::uint8_t> bytes, bool binary, std::size_t node_bytes)
      : bytes_(bytes), binary_(binary), node_bytes_(node_bytes) {}

  /// nullptr, or what is wrong.
  const char* walk() {
    count_ = 1;
    return binary_ ? inner(0) : full(0);
  }
  [[nodiscard]] std::uint64_t count() const { return count_; }
  [[nodiscard]] std::size_t used() const { return at_; }

 private:
  [[nodiscard]] bool left(std::size_t bytes) const { return bytes_.size() - at_ >= bytes; }

  /// .bt: two bits a child: 0 unknown, 1 and 2 leaves, 3 a node with children of its own.
  const char* inner(int level) {
    if (!left(2)) return "is cut: its nodes go on beyond its end";
    if (level >= kLevels) return "has nodes deeper than 16 levels";
    const unsigned children = bytes_[at_] | static_cast<unsigned>(bytes_[at_ + 1]) << 8U;
    at_ += 2;
    for (unsigned i = 0; i < 8; ++i) {
      const unsigned child = children >> (2 * i) & 3U;
      count_ += child != 0;
      if (child != 3) continue;
      if (const char* wrong = inner(level + 1)) return wrong;
    }
    return nullptr;
  }

  /// .ot: log-odds, colour if any, one bit a child.
  const char* full(int level) {
    if (!left(node_bytes_ + 1)) return "is cut: its nodes go on beyond its end";
    float log_odds = 0;
    std::memcpy(&log_odds, bytes_.data() + at_, sizeof log_odds);
    if (!std::isfinite(log_odds)) return "holds a node whose log-odds are no number";
    const unsigned children = bytes_[at_ + node_bytes_];
    at_ += node_bytes_ + 1;
    if (children != 0 && level >= kLevels) return "has nodes deeper than 16 levels";
    for (unsigned i = 0; i < 8; ++i) {
      if ((children >> i & 1U) == 0) continue;
      ++count_;
      if (const char* wrong = full(level + 1)) return wrong;
    }
    return nullptr;
  }

  std::span<const std::uint8_t> bytes_;
  bool binary_;
  std::size_t node_bytes_;
  std::size_t at_ = 0;
  std::uint64_t count_ = 0;
};

}  // namespace

Result<OctomapHeader> check_octomap(std::span<const std::uint8_t> file, const std::string& name) {
  const auto bad = [&name](const std::string& what) {
    return Error{ErrorCode::kBadData, name, what, "give a .bt or .ot file as OctoMap writes it"};
  };
  const std::string_view text(reinterpret_cast<const char*>(file.data()),
                              std::min(file.size(), kMaxHeader));
  OctomapHeader header;
  header.binary = text.starts_with(kBinary);
  if (!header.binary && !text.starts_with(kFull)) return bad("is no OctoMap file");
  bool have_size = false, have_res = false, have_data = false;
  std::size_t at = 0;
  while (!have_data) {
    const std::size_t end = text.find('\n', at);
    if (end == std::string_view::npos) return bad("has no end of its header");
    std::string_view line = text.substr(at, end - at);
    at = end + 1;
    const std::string_view key = word(line);
    const std::string_view value = word(line);
    if (key == "data") have_data = true;
    if (key.empty() || key.starts_with('#') || key == "data") continue;
    if (!word(line).empty()) return bad("has a header line of more than a key and a value");
    if (key == "id") {
      if (!header.id.empty()) return bad("says twice what it is");
      header.id = value;
    } else if (key == "size") {
      if (have_size || !parse(value, header.nodes)) return bad("has no size that is one number");
      have_size = true;
    } else if (key == "res") {
      if (have_res || !parse(value, header.voxel_m)) return bad("has no res that is one number");
      have_res = true;
    } else {
      return bad("has a header line that OctoMap does not write");
    }
  }
  if (!have_size || !have_res || header.id.empty()) return bad("has no id, size or res");
  // Written so that NaN is refused as well.
  if (!(header.voxel_m >= kFinest && header.voxel_m <= kCoarsest))
    return bad("has a res outside 0.0001 .. 100 m");
  const bool coloured = header.id == "ColorOcTree";
  if (header.id != "OcTree" && (!coloured || header.binary))
    return bad("is no OctoMap tree of a known kind: '" + header.id.substr(0, 40) + "'");
  const std::span<const std::uint8_t> nodes = file.subspan(at);
  if (header.nodes > kMaxOctomapNodes)
    return bad("declares " + std::to_string(header.nodes) + " nodes: more than 50 million");
  if (header.nodes == 0) {
    if (nodes.empty()) return header;
    return bad("declares no nodes and holds some");
  }
  NodeWalk walk(nodes, header.binary, coloured ? 7 : 4);
  if (const char* wrong = walk.walk()) return bad(wrong);
  if (walk.count() != header.nodes)
    return bad("declares " + std::to_string(header.nodes) + " nodes and holds " +
               std::to_string(walk.count()));
  if (walk.used() != nodes.size())
    return bad("goes on for " + std::to_string(nodes.size() - walk.used()) +
               " bytes after its last node");
  return header;
}

}  // namespace crane
