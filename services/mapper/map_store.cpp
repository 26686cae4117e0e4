// SPDX-License-Identifier: Apache-2.0
#include "mapper/map_store.hpp"

#include <chrono>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <sstream>

#include "base/loop_watch.hpp"
#include "base/read_file.hpp"
#include "base/write_file.hpp"
#include "cloud/pcl_filters.hpp"
#include "config/yaml_reader.hpp"
#include "map_codec/crc32c.hpp"
#include "map_codec/octree_stream.hpp"
#include "map_codec/tile_snapshot.hpp"

namespace crane {
namespace {

namespace fs = std::filesystem;

constexpr std::chrono::seconds kWrittenWithin{30};  ///< a disk that takes longer hangs
constexpr std::uint64_t kMaxAccountBytes = 1U << 16U, kMaxTileBytes = 64U << 20U;
constexpr const char* kFormat = "format: 2\n";
constexpr const char* kChecksum = "checksum: ";

Error disk_error(const std::string& path) {
  return {ErrorCode::kResource, path, "cannot be written", "check permissions and free space"};
}

Result<void> make_folder(const std::string& folder) {
  std::error_code failed;
  fs::create_directories(folder, failed);
  if (failed) return disk_error(folder);
  return {};
}

/// All of a folder's tiles, or an error: a part of a map is not a map.
Result<std::vector<fs::path>> tile_files(const std::string& folder) {
  std::vector<fs::path> tiles;
  std::error_code failed;
  fs::directory_iterator entry(folder, failed);
  for (const fs::directory_iterator end; !failed && entry != end; entry.increment(failed))
    if (entry->path().extension() == ".tile") tiles.push_back(entry->path());
  if (failed)
    return Error{ErrorCode::kResource, folder, "cannot be read to its end: " + failed.message(),
                 "check its permissions and its disk"};
  return tiles;
}

Result<Bytes> read_tile(const fs::path& path) {
  const auto text = read_file(path.string(), kMaxTileBytes);
  if (!text) return text.error();
  if (text->empty())
    return Error{ErrorCode::kBadData, path, "is empty", "bring it back from a copy"};
  return Bytes(text->begin(), text->end());
}

std::uint32_t checksum(const std::string& text) {
  return crc32c({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

/// The account, whole as it was written: its last line is a checksum of those before.
Result<std::string> read_account(const std::string& path) {
  auto text = read_file(path, kMaxAccountBytes);
  if (!text) return text.error();
  const std::size_t at = text->rfind(kChecksum);
  // Of an earlier version, which had neither.
  if (at == std::string::npos && text->find("format:") == std::string::npos) return text;
  const std::string kept = at == std::string::npos ? "" : text->substr(0, at);
  if (*text != kept + kChecksum + std::to_string(checksum(kept)) + "\n")
    return Error{ErrorCode::kBadData, path, "is damaged: its checksum is of other content",
                 "bring the folder back from a copy, or remove it and map anew"};
  return text;
}

/// Tiles first: the account promises no frame that they do not have.
Result<void> write_state(const std::string& folder, std::vector<NamedBytes> tiles,
                         const std::string& account) {
  if (auto made = make_folder(folder); !made) return made;
  for (auto& [name, bytes] : tiles) bytes = pack_snapshot(bytes);
  if (auto written = write_files(folder, tiles); !written) return written;
  return write_file(folder + "/account.yaml", reinterpret_cast<const std::uint8_t*>(account.data()),
                    account.size());
}

}  // namespace

Result<void> save_map(MappingPipeline& pipeline, const std::string& folder) {
  if (auto made = make_folder(folder); !made) return made;
  const Bytes bt = write_bt(pipeline.map());
  if (auto r = write_file(folder + "/map.bt", bt.data(), bt.size()); !r) return r;
  const Bytes ot = write_colour_ot(pipeline.map());
  if (auto r = write_file(folder + "/map.ot", ot.data(), ot.size()); !r) return r;
  const PointCloud cloud = pipeline.paper_cloud() != nullptr ? *pipeline.paper_cloud()
                                                             : pipeline.map().occupied_points();
  if (cloud.empty()) return {};  // an empty map has no points; PCD cannot say so
  const std::string partial = folder + "/map.pcd.part";
  if (auto r = write_pcd(partial, cloud); !r) return r;
  return put_in_place(partial, folder + "/map.pcd");
}

Result<MapStore::State> MapStore::load(MappingPipeline& pipeline) {
  State state;
  const std::string account = folder_ + "/account.yaml";
  std::error_code unreadable;
  if (!fs::exists(account, unreadable)) {
    if (unreadable)
      return Error{ErrorCode::kResource, account, "cannot be read: " + unreadable.message(),
                   "check its permissions and its disk"};
    // Tiles without an account are of a map that was ended: they are none of the next one's.
    if (auto cleared = clear(); !cleared) return cleared.error();
    return state;
  }
  const auto kept = read_account(account);
  if (!kept) return kept.error();
  auto y = YamlReader::from_text(*kept, account);
  if (!y) return y.error();
  for (const char* key : {"format", "checksum"}) y->ignore(key);
  const auto number = [&y](const char* key) {
    std::string text;
    y->text(key, text, true);
    return std::strtoull(text.c_str(), nullptr, 10);
  };
  double voxel = 0;
  y->number("voxel_m", voxel, 0, 10, true);
  const auto age = static_cast<TimeNs>(number("age_ns"));
  state.revision = number("revision");
  FrameAccount& a = state.account;
  a.stream = number("stream");
  a.last_frame = static_cast<std::int64_t>(number("last_frame")) - 1;
  a.last_frame_time = static_cast<TimeNs>(number("last_frame_time_ns"));
  a.integrated = number("integrated");
  a.rejected = number("rejected");
  a.missing = number("missing");
  const std::uint64_t least = number("tiles");
  if (auto done = y->finish(); !done) return done.error();
  if (voxel != pipeline.voxel_m())
    return Error{ErrorCode::kConfiguration, folder_,
                 "holds a map of another voxel size (" + std::to_string(voxel) + " m)",
                 "give another --state folder, or remove this one"};
  const auto tiles = tile_files(folder_);
  if (!tiles) return tiles.error();
  if (tiles->size() < least)
    return Error{ErrorCode::kBadData, folder_,
                 "has " + std::to_string(tiles->size()) + " of at least " + std::to_string(least) +
                     " tiles: the rest was removed or cannot be seen",
                 "bring it back from a copy, or remove the folder and map anew"};
  for (const fs::path& path : *tiles) {
    const auto bytes = read_tile(path);
    if (!bytes) return bytes.error();
    if (auto read = read_snapshot(*bytes, pipeline.map()); !read)
      return Error{read.error().code, path, read.error().what,
                   "remove the folder " + folder_ + " and map anew"};
  }
  for (const TileKey key : pipeline.map().tile_keys()) on_disk_.insert(key);
  if (on_disk_.size() < least)
    return Error{ErrorCode::kBadData, folder_,
                 "holds " + std::to_string(on_disk_.size()) + " different tiles of at least " +
                     std::to_string(least) + ": some files are copies of others",
                 "bring it back from a copy, or remove the folder and map anew"};
  pipeline.restore(a, age);
  state.found = true;
  return state;
}

Result<void> MapStore::clear() {
  std::error_code failed;
  if (folder_.empty() || !fs::exists(folder_, failed)) return {};
  on_disk_.clear();
  fs::remove(folder_ + "/account.yaml", failed);  // first: without it the tiles are nothing
  const auto tiles = tile_files(folder_);
  if (!tiles) return tiles.error();
  for (const fs::path& tile : *tiles)
    if (!failed) fs::remove(tile, failed);
  if (failed) return disk_error(folder_);
  return {};
}

void MapStore::note_changes(MappingPipeline& pipeline) {
  for (const Tile* tile : pipeline.map().changed_tiles()) unsaved_.insert(tile->key);
}

MapStore::~MapStore() {
  if (saving_.valid()) saving_.wait();
}

Result<void> MapStore::save(MappingPipeline& pipeline, const State& state) {
  if (saving_.valid()) {
    if (saving_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return {};
    if (auto saved = taken(); !saved) return saved;  // its tiles are for the next time
  }
  std::vector<NamedBytes> tiles;
  for (const TileKey key : unsaved_)
    if (const Tile* tile = pipeline.map().find(key))
      tiles.emplace_back(std::to_string(key.x) + "_" + std::to_string(key.y) + ".tile",
                         tile_bytes(*tile));
  for (const TileKey key : unsaved_) on_disk_.insert(key);
  being_saved_ = std::move(unsaved_);
  unsaved_.clear();
  std::ostringstream s;
  s.precision(17);
  const FrameAccount& a = state.account;
  s << kFormat << "voxel_m: " << pipeline.voxel_m() << "\nage_ns: " << pipeline.report().age
    << "\nrevision: " << state.revision << "\nstream: " << a.stream
    << "\ntiles: " << on_disk_.size() << "\nlast_frame: " << a.last_frame + 1
    << "  # plus one: 0 = none"
    << "\nlast_frame_time_ns: " << a.last_frame_time << "\nintegrated: " << a.integrated
    << "\nrejected: " << a.rejected << "\nmissing: " << a.missing << "\n";
  saving_ = std::async(std::launch::async,
                       [folder = folder_, tiles = std::move(tiles),
                        account = s.str() + kChecksum + std::to_string(checksum(s.str())) +
                                  "\n"]() mutable -> Result<void> {
                         name_thread("map to disk");
                         const auto writing =
                             LoopWatch::of_process().watch("saving the map", kWrittenWithin);
                         try {
                           return write_state(folder, std::move(tiles), account);
                         } catch (const std::exception& e) {
                           return Error{ErrorCode::kResource, folder,
                                        std::string("cannot be written: ") + e.what(), ""};
                         }
                       });
  return {};
}

Result<void> MapStore::taken() {
  auto saved = saving_.get();
  if (!saved) unsaved_.merge(being_saved_);
  trouble_ = saved ? "" : saved.error().text();
  being_saved_.clear();
  return saved;
}

Result<void> MapStore::finish() {
  return saving_.valid() ? taken() : Result<void>{};
}

}  // namespace crane
