// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <future>
#include <set>
#include <string>

#include "base/result.hpp"
#include "mapping_pipeline/mapping_pipeline.hpp"

namespace crane {

/// Writes map.bt, map.ot (colour) and map.pcd. Each appears whole or not at all.
/// Error: Resource, with the file.
Result<void> save_map(MappingPipeline& pipeline, const std::string& folder);

/// The map on disk, tile by tile, so that a mapper that was killed goes on where it stopped.
/// What is written depends on what changed. A file is whole or absent; the account is written
/// last, so that it never promises frames that the tiles do not have.
class MapStore {
 public:
  struct State {
    bool found = false;
    std::uint64_t revision = 0;
    FrameAccount account;
  };

  explicit MapStore(std::string folder) : folder_(std::move(folder)) {}
  ~MapStore();

  /// Reads what is there into the pipeline. Nothing there: not found.
  /// Error: BadData when it is damaged, tiles are missing, or it was made with another voxel size;
  /// Resource when not all of it can be read. A part of a map is never taken for the map.
  Result<State> load(MappingPipeline& pipeline);
  /// Removes what is there: a map begins that does not go on with it. Error: Resource.
  Result<void> clear();
  /// Remembers which tiles have changed flags now, for the next save().
  void note_changes(MappingPipeline& pipeline);
  [[nodiscard]] bool unsaved() const { return !unsaved_.empty(); }
  /// Tiles noted since the last save, then the account, by a thread of its own; nothing happens
  /// while the last save is still at it. Error: what the last save met; its tiles are then noted
  /// again, so that nothing is lost once there is room.
  Result<void> save(MappingPipeline& pipeline, const State& state);
  /// What the save that ended last met; empty: nothing, all of it is on disk.
  [[nodiscard]] const std::string& trouble() const { return trouble_; }
  /// Waits for the last save. Error: what it met.
  Result<void> finish();

 private:
  std::string folder_;
  /// Takes the result of the save that has ended.
  Result<void> taken();

  std::set<TileKey> unsaved_, being_saved_;
  std::set<TileKey> on_disk_;  ///< once the save that runs has ended

  std::string trouble_;
  std::future<Result<void>> saving_;
};

}  // namespace crane
