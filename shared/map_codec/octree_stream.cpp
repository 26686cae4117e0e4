// SPDX-License-Identifier: Apache-2.0
#include "map_codec/octree_stream.hpp"

#include <algorithm>
#include <cstring>
#include <functional>
#include <memory>
#include <sstream>
#include <string>

namespace crane {
namespace {

constexpr const char* kBtFirstLine = "# Octomap OcTree binary file";
constexpr int kTreeDepth = 16;                  // OctoMap's
constexpr int kBlockLevel = 5;                  // a block is a cube of 2^5 voxels
constexpr int kOrigin = 1 << (kTreeDepth - 1);  // OctoMap key of voxel 0
constexpr int kBlockOrigin = kOrigin >> kBlockLevel;
constexpr int kBlockTreeDepth = kTreeDepth - kBlockLevel;

struct BlockRef {
  std::uint64_t morton = 0;
  TileKey tile;
  int z = 0;
  const Block* block = nullptr;
  const BlockClasses* classes = nullptr;  ///< where there is no block
};

/// Child order of OctoMap: bit 0 = x, bit 1 = y, bit 2 = z.
std::uint64_t morton(int x, int y, int z) {
  std::uint64_t m = 0;
  for (int bit = 0; bit < kBlockTreeDepth; ++bit)
    m |= (std::uint64_t(x >> bit & 1) | std::uint64_t(y >> bit & 1) << 1U |
          std::uint64_t(z >> bit & 1) << 2U)
         << (3 * bit);
  return m;
}

void add(std::vector<BlockRef>& refs, TileKey tile, int bz, const Block* block,
         const BlockClasses* classes) {
  const auto fits = [](int v) { return v >= -kBlockOrigin && v < kBlockOrigin; };
  if (fits(tile.x) && fits(tile.y) && fits(bz))
    refs.push_back({morton(tile.x + kBlockOrigin, tile.y + kBlockOrigin, bz + kBlockOrigin), tile,
                    bz, block, classes});
}

std::vector<BlockRef> sorted(std::vector<BlockRef> refs) {
  std::sort(refs.begin(), refs.end(), [](auto& a, auto& b) { return a.morton < b.morton; });
  return refs;
}

std::vector<BlockRef> sorted_blocks(const OccupancyMap& map) {
  std::vector<BlockRef> refs;
  for (const Tile* tile : map.tiles())
    for (const auto& [bz, block] : tile->blocks) add(refs, tile->key, bz, block.get(), nullptr);
  return sorted(std::move(refs));
}

std::string header(const char* first_line, const char* id, std::size_t nodes, double voxel_m) {
  std::ostringstream s;
  s << first_line
    << "\n# (feel free to add / change comments, but leave the first line as it is!)\n#\n"
    << "id " << id << "\nsize " << nodes << "\nres " << voxel_m << "\ndata\n";
  return s.str();
}

/// Depth-first over the tree. Writer decides what a voxel is, how an inner node is written, and
/// when eight children become one leaf. Writer::Value says what a subtree is.
template <class Writer>
class TreeWalk {
 public:
  explicit TreeWalk(Writer& writer) : writer_(writer) {}

  using Value = typename Writer::Value;

  Value blocks(std::span<const BlockRef> refs, int level) {
    if (refs.empty()) return Value{};
    if (level == kBlockLevel)
      return writer_.block(refs.front(),
                           [&] { return inside(content(refs.front()), level, 0, 0, 0); });
    const auto mark = writer_.begin_node();
    std::array<Value, 8> children{};
    std::size_t first = 0;
    for (std::uint64_t child = 0; child < 8; ++child) {
      std::size_t last = first;
      const int shift = 3 * (level - kBlockLevel - 1);
      while (last < refs.size() && (refs[last].morton >> shift & 7U) == child) ++last;
      children[child] = blocks(refs.subspan(first, last - first), level - 1);
      first = last;
    }
    return writer_.end_node(mark, children, level == kTreeDepth);
  }

 private:
  const Block& content(const BlockRef& ref) {
    if (ref.block != nullptr) return *ref.block;
    if (!scratch_) scratch_ = std::make_unique<Block>();
    for (std::size_t i = 0; i < kBlockVoxels; ++i) {
      const unsigned c = (*ref.classes)[i / 4] >> (2 * (i % 4)) & 3U;
      scratch_->log_odds[i] = static_cast<std::int8_t>(c == 2 ? kHit : c == 1 ? kMiss : 0);
    }
    return *scratch_;
  }
  /// Cube of 2^level voxels at (x, y, z) in a block.
  Value inside(const Block& block, int level, int x, int y, int z) {
    if (level == 0) return writer_.voxel(block, (z * kTileEdge + y) * kTileEdge + x);
    const auto mark = writer_.begin_node();
    std::array<Value, 8> children{};
    const int half = 1 << (level - 1);
    for (int child = 0; child < 8; ++child)
      children[std::size_t(child)] =
          inside(block, level - 1, x + ((child & 1) != 0 ? half : 0),
                 y + ((child & 2) != 0 ? half : 0), z + ((child & 4) != 0 ? half : 0));
    return writer_.end_node(mark, children, false);
  }

  Writer& writer_;
  std::unique_ptr<Block> scratch_;
};

/// .bt: an inner node is 2 bits per child: 00 unknown, 01 free, 10 occupied, 11 has children.
struct BinaryWriter {
  using Value = std::uint8_t;  // those two bits
  static constexpr Value kInner = 3;
  Bytes out;
  std::size_t nodes = 1;
  /// Finds a block's subtree, made empty when it is not known; may be empty itself.
  std::function<BtWriter::Subtree&(const BlockRef&)> known;

  template <class Encode>
  Value block(const BlockRef& ref, Encode encode) {
    if (!known) return encode();
    BtWriter::Subtree& kept = known(ref);
    if (kept.bytes.empty() && kept.value == 0) {
      const Mark mark{out.size(), nodes};
      kept.value = encode();
      kept.bytes.assign(out.begin() + std::ptrdiff_t(mark.at), out.end());
      kept.nodes = nodes - mark.nodes;
    } else {
      out.insert(out.end(), kept.bytes.begin(), kept.bytes.end());
      nodes += kept.nodes;
    }
    return kept.value;
  }

  struct Mark {
    std::size_t at, nodes;
  };
  static Value voxel(const Block& block, int index) { return static_cast<Value>(block.at(index)); }
  Mark begin_node() {
    out.resize(out.size() + 2);
    return {out.size() - 2, nodes};
  }
  Value end_node(Mark mark, const std::array<Value, 8>& children, bool root) {
    const bool same =
        std::all_of(children.begin(), children.end(), [&](Value c) { return c == children[0]; });
    if (same && children[0] != kInner && !root) {
      out.resize(mark.at);
      nodes = mark.nodes;
      return children[0];
    }
    unsigned bits = 0;
    for (std::size_t i = 0; i < 8; ++i) {
      bits |= unsigned(children[i]) << (2 * i);
      nodes += children[i] != 0 ? 1 : 0;
    }
    out[mark.at] = static_cast<std::uint8_t>(bits);
    out[mark.at + 1] = static_cast<std::uint8_t>(bits >> 8U);
    return kInner;
  }
};

/// .ot of ColorOcTree: each node is log-odds (float), red, green, blue, mask of its children.
struct ColourWriter {
  struct Value {
    bool known = false, inner = false;
    std::int8_t log_odds = 0;
    std::uint8_t r = 255, g = 255, b = 255;
  };
  static constexpr std::size_t kNodeBytes = 8;
  Bytes out;
  std::size_t nodes = 0;

  template <class Encode>
  Value block(const BlockRef&, Encode encode) {
    return encode();
  }

  struct Mark {
    std::size_t at, nodes;
  };
  Value voxel(const Block& block, int index) {
    Value v;
    v.log_odds = block.log_odds[std::size_t(index)];
    v.known = classify(v.log_odds) != Occupancy::kUnknown;
    if (!v.known) return v;
    const auto& layer = block.surface[std::size_t(index / kTileColumns)];
    if (v.log_odds > 0 && layer) {
      const Surface& s = (*layer)[std::size_t(index % kTileColumns)];
      if (s.weight > 0) v.r = s.r, v.g = s.g, v.b = s.b;
    }
    put(v, 0);
    return v;
  }
  Mark begin_node() {
    out.resize(out.size() + kNodeBytes);
    return {out.size() - kNodeBytes, nodes++};
  }
  Value end_node(Mark mark, const std::array<Value, 8>& children, bool root) {
    Value v;
    bool same = true;
    unsigned mask = 0;
    int r = 0, g = 0, b = 0, coloured = 0;
    for (std::size_t i = 0; i < 8; ++i) {
      const Value& c = children[i];
      same &= c.known && !c.inner && c.log_odds == children[0].log_odds;
      if (!c.known) continue;
      mask |= 1U << i;
      if (!v.known || c.log_odds > v.log_odds) v.log_odds = c.log_odds;
      v.known = true;
      if (c.log_odds > 0) r += c.r, g += c.g, b += c.b, ++coloured;
    }
    if (coloured > 0) {
      v.r = static_cast<std::uint8_t>(r / coloured);
      v.g = static_cast<std::uint8_t>(g / coloured);
      v.b = static_cast<std::uint8_t>(b / coloured);
    }
    if (!v.known && !root) {
      out.resize(mark.at);
      nodes = mark.nodes;
      return v;
    }
    if (same && !root) {
      out.resize(mark.at);
      nodes = mark.nodes;
      put(v, 0);
      return v;
    }
    v.inner = true;
    write_at(mark.at, v, mask);
    return v;
  }

 private:
  void put(const Value& v, unsigned mask) {
    out.resize(out.size() + kNodeBytes);
    write_at(out.size() - kNodeBytes, v, mask);
    ++nodes;
  }
  void write_at(std::size_t at, const Value& v, unsigned mask) {
    const float log_odds = float(v.log_odds) / 32.0F;
    std::memcpy(out.data() + at, &log_odds, 4);  // OctoMap writes host order: little-endian here
    out[at + 4] = v.r;
    out[at + 5] = v.g;
    out[at + 6] = v.b;
    out[at + 7] = static_cast<std::uint8_t>(mask);
  }
};

template <class Writer>
Bytes write(Writer writer, const std::vector<BlockRef>& refs, double voxel_m,
            const char* first_line, const char* id) {
  if (refs.empty())
    writer.nodes = 0;
  else
    TreeWalk<Writer>(writer).blocks(refs, kTreeDepth);
  const std::string head = header(first_line, id, writer.nodes, voxel_m);
  Bytes file(head.begin(), head.end());
  file.insert(file.end(), writer.out.begin(), writer.out.end());
  return file;
}

}  // namespace

Bytes write_bt(const OccupancyMap& map) {
  return write(BinaryWriter{}, sorted_blocks(map), map.voxel_m(), kBtFirstLine, "OcTree");
}

Bytes write_bt(double voxel_m, std::span<const ClassBlock> blocks) {
  std::vector<BlockRef> refs;
  for (const ClassBlock& b : blocks) add(refs, b.tile, b.z, nullptr, &b.classes);
  return write(BinaryWriter{}, sorted(std::move(refs)), voxel_m, kBtFirstLine, "OcTree");
}

Bytes BtWriter::write(const OccupancyMap& map) {
  BinaryWriter writer;
  writer.known = [this](const BlockRef& ref) -> Subtree& { return tiles_[ref.tile][ref.z]; };
  return crane::write(std::move(writer), sorted_blocks(map), map.voxel_m(), kBtFirstLine, "OcTree");
}

Bytes write_colour_ot(const OccupancyMap& map) {
  return write(ColourWriter{}, sorted_blocks(map), map.voxel_m(), "# Octomap OcTree file",
               "ColorOcTree");
}

}  // namespace crane
