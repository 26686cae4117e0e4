#include "mapper/map_store.hpp"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "base/write_file.hpp"
#include "cloud/pcl_filters.hpp"
#include "config/yaml_reader.hpp"
#include "map_codec/octree_stream.hpp"
#include "map_codec/tile_snapshot.hpp"

namespace crane {
namespace {

namespace fs = std::filesystem;

Error disk_error(const std::string& path) {
  return {ErrorCode::kResource, path, "cannot be written", "check permissions and free space"};
}

Result<void> make_folder(const std::string& folder) {
  std::error_code failed;
  fs::create_directories(folder, failed);
  if (failed) return disk_error(folder);
  return {};
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

Result<void> save_map(MapBuilder& builder, const std::string& folder) {
  if (auto made = make_folder(folder); !made) return made;
  const Bytes bt = write_bt(builder.map());
  if (auto r = write_file(folder + "/map.bt", bt.data(), bt.size()); !r) return r;
  const Bytes ot = write_colour_ot(builder.map());
  if (auto r = write_file(folder + "/map.ot", ot.data(), ot.size()); !r) return r;
  const PointCloud cloud =
      builder.paper_cloud() != nullptr ? *builder.paper_cloud() : builder.map().occupied_points();
  if (cloud.empty()) return {};  // an empty map has no points; PCD cannot say so
  const std::string partial = folder + "/map.pcd.part";
  if (auto r = write_pcd(partial, cloud); !r) return r;
  return put_in_place(partial, folder + "/map.pcd");
}

Result<MapStore::State> MapStore::load(MapBuilder& builder) {
  State state;
  const std::string account = folder_ + "/account.yaml";
  if (!fs::exists(account)) return state;
  auto y = YamlReader::from_file(account);
  if (!y) return y.error();
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
  if (auto done = y->finish(); !done) return done.error();
  if (voxel != builder.voxel_m())
    return Error{ErrorCode::kConfiguration, folder_,
                 "holds a map of another voxel size (" + std::to_string(voxel) + " m)",
                 "give another --state folder, or remove this one"};
  std::error_code failed;
  for (fs::directory_iterator entry(folder_, failed), end; !failed && entry != end;
       entry.increment(failed)) {
    if (entry->path().extension() != ".tile") continue;
    std::ifstream file(entry->path(), std::ios::binary);
    const Bytes bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
    if (auto read = read_snapshot(bytes, builder.map()); !read)
      return Error{read.error().code, entry->path(), read.error().what,
                   "remove the folder " + folder_ + " and map anew"};
  }
  builder.restore(a, age);
  state.found = true;
  return state;
}

Result<void> MapStore::clear() {
  if (folder_.empty() || !fs::exists(folder_)) return {};
  std::error_code failed;
  fs::remove(folder_ + "/account.yaml", failed);  // first: without it the tiles are nothing
  std::vector<fs::path> tiles;
  for (fs::directory_iterator entry(folder_, failed), end; !failed && entry != end;
       entry.increment(failed))
    if (entry->path().extension() == ".tile") tiles.push_back(entry->path());
  for (const fs::path& tile : tiles)
    if (!failed) fs::remove(tile, failed);
  if (failed) return disk_error(folder_);
  return {};
}

void MapStore::note_changes(MapBuilder& builder) {
  for (const Tile* tile : builder.map().changed_tiles()) unsaved_.insert(tile->key);
}

MapStore::~MapStore() {
  if (saving_.valid()) saving_.wait();
}

Result<void> MapStore::save(MapBuilder& builder, const State& state) {
  if (saving_.valid()) {
    if (saving_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return {};
    if (auto saved = taken(); !saved) return saved;  // its tiles are for the next time
  }
  std::vector<NamedBytes> tiles;
  for (const TileKey key : unsaved_)
    if (const Tile* tile = builder.map().find(key))
      tiles.emplace_back(std::to_string(key.x) + "_" + std::to_string(key.y) + ".tile",
                         tile_bytes(*tile));
  being_saved_ = std::move(unsaved_);
  unsaved_.clear();
  std::ostringstream s;
  s.precision(17);
  const FrameAccount& a = state.account;
  s << "voxel_m: " << builder.voxel_m() << "\nage_ns: " << builder.age()
    << "\nrevision: " << state.revision << "\nstream: " << a.stream
    << "\nlast_frame: " << a.last_frame + 1 << "  # plus one: 0 = none"
    << "\nlast_frame_time_ns: " << a.last_frame_time << "\nintegrated: " << a.integrated
    << "\nrejected: " << a.rejected << "\nmissing: " << a.missing << "\n";
  saving_ = std::async(std::launch::async,
                       [folder = folder_, tiles = std::move(tiles), account = s.str()]() mutable {
                         return write_state(folder, std::move(tiles), account);
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
