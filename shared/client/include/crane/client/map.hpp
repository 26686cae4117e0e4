// SPDX-License-Identifier: Apache-2.0
#pragma once

// The crane controller's view of the map. Needs the C++17 standard library only.

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "crane/client/clearance.hpp"
#include "crane/client/zone.hpp"
#include "crane/network.hpp"

namespace eprosima::fastdds::dds {
class DomainParticipant;
}

namespace crane::client {

/// Which crane's map, and what it may take.
struct MapOptions {
  std::uint32_t crane = 1;
  /// Of the tiles that are held, some 0.2 MB each at 5 cm and 9 m. A map that needs more is
  /// invalid, and status() says so. Beside it: 32 MiB of tiles that wait to be believed, what an
  /// answer is made of (a grid of heights() above all), and what DDS keeps, 64 MiB of shared memory
  /// with it.
  std::uint32_t max_memory_mib = 2048;
};

/// And where on the network: as section `dds` of the services' configuration. Where no identity is
/// named it is "controller".
struct Options : MapOptions, NetworkSettings {};

/// What the mapper last said of the map, and what of it has arrived here.
struct Status {
  bool heard = false;     ///< any heartbeat at all
  bool alive = false;     ///< a heartbeat within the last second
  bool valid = false;     ///< alive, and clouds and positions are fresh
  bool complete = false;  ///< all tiles and zones of the said revision are here (digests agree)
  std::string reason;     ///< why not valid
  std::uint32_t reason_code = 0;  ///< the same as a number: MAP_* of idl/v1/bounds.idl
  std::uint64_t mapper = 0;       ///< the process that serves the map
  std::uint64_t map_id = 0, revision = 0;
  std::uint64_t voxel_digest = 0, height_digest = 0;  ///< of what is held *here*
  std::uint32_t tiles = 0;                            ///< of voxels, held here
  std::uint64_t zones_revision = 0;                   ///< of the zones held here
  double voxel_m = 0;
  std::uint64_t stream = 0, last_frame = 0;
  std::int64_t last_frame_time_ns = 0;  ///< 0 = no frame accounted for yet
  std::uint64_t frames_integrated = 0, frames_rejected = 0, frames_missing = 0;
  enum class Hoist { kNotUsed, kKnown, kLost };
  Hoist hoist = Hoist::kNotUsed;  ///< what the mapper knows of hook and load
  /// The rope's top, or the highest mapped height when that is lower: kToRopeTop reaches to it.
  double ceiling_m = 0;
  double forget_s = 0;  ///< what is not seen again for so long is unknown; 0 = never
  /// Samples that failed a check, or of a writer that is not the mapper; never used.
  std::uint64_t samples_refused = 0;
  std::uint64_t memory_bytes = 0;  ///< of the tiles held here, see Options::max_memory_mib
  std::uint64_t resyncs = 0;       ///< times that missing tiles were asked for again
};

/// kStale: it was seen, but not again for too long; as unknown as what was never seen.
enum class Surface { kUnknown, kFloor, kObstacle, kStale };

constexpr bool is_known(Surface s) {
  return s == Surface::kFloor || s == Surface::kObstacle;
}

/// The highest surface over one point of the floor. Unknown is not free. A height says nothing of
/// what is above free_to_m, and never that a load may go there: ask clearance() for that.
struct Height {
  Surface surface = Surface::kUnknown;
  double height_m = 0, spread_m = 0;
  /// The true height may be more: the space right above was never seen to be free, or has a gap.
  bool lower_bound = false;
  double free_to_m = 0;     ///< from the surface up to here it is known to be free
  std::uint32_t views = 0;  ///< frames that saw this surface, to 32; 1 = it rests on one view
  std::int64_t last_observed_ns = 0;  ///< to 1 s; 0 = never
  /// Hook or load have been here, down to proven_m, since a surface was last seen higher.
  bool proven_by_hook = false;
  double proven_m = 0;
};

/// Heights of what is held, as a grid; row 0 has the lowest y. Its size goes by how much is held,
/// not by how far apart: see tiles_left_out.
struct HeightGrid {
  double cell_m = 0, origin_x_m = 0, origin_y_m = 0;
  std::uint32_t columns = 0, rows = 0;
  std::vector<Height> cells;
  std::uint32_t tiles_left_out = 0;  ///< too far from the others: see Map::heights
  /// Centre of cells[i] [m].
  [[nodiscard]] double x_m(std::size_t i) const {
    return origin_x_m + (static_cast<double>(i % columns) + 0.5) * cell_m;
  }
  [[nodiscard]] double y_m(std::size_t i) const {
    const std::size_t row = i / columns;
    return origin_y_m + (static_cast<double>(row) + 0.5) * cell_m;
  }
};

/// What one batch of samples changed.
struct Update {
  std::uint64_t map_id = 0, revision = 0;  ///< as the mapper last said
  bool valid = false, complete = false;    ///< as in Status
  std::vector<Area> areas;                 ///< of the tiles that changed
};

/// Follows one crane's map. Late joiners get the whole current map. Thread-safe; queries never
/// wait for the network. Nothing throws: without memory for an answer it is that nothing is known.
/// The program's own Fast DDS log and library settings stay as they are. Advisory only: limit
/// switches stay in the safety controller.
class Map {
 public:
  /// Joins; nullptr and the reason in `error` when that is impossible.
  static std::unique_ptr<Map> join(const Options& options, std::string& error) noexcept;
  /// Joins within a participant that this process has already, of the same Fast DDS library, so
  /// that the process is on the network once. It must be enabled. None of its settings is touched,
  /// its listeners hear nothing of the map, and with the map all goes that was made in it. What it
  /// receives is only checked as whoever made it took care of: without a guard before Fast DDS one
  /// malformed datagram can end the process. A topic of ours that it has a type of its own for is
  /// an error.
  /// The participant must outlive the map: delete_participant() refuses while the map is there. Who
  /// calls its delete_contained_entities() or deletes it all the same takes the map's readers away:
  /// from then on the map is invalid and status().reason says so, and it may be destroyed. Doing so
  /// while a call of join(), or the destructor, is going on is not detected.
  static std::unique_ptr<Map> join(eprosima::fastdds::dds::DomainParticipant& participant,
                                   const MapOptions& options, std::string& error) noexcept;
  ~Map();
  Map(const Map&) = delete;
  Map& operator=(const Map&) = delete;

  [[nodiscard]] Status status() const noexcept;
  /// Waits until the whole current map is here; false on time-out.
  [[nodiscard]] bool wait_until_complete(std::chrono::milliseconds limit) const noexcept;

  [[nodiscard]] Height height(double x_m, double y_m) const noexcept;
  /// All tiles, if a grid around them has at most four cells a column held, or four million in all;
  /// else those around the middle one, and the number of the others.
  [[nodiscard]] HeightGrid heights() const noexcept;
  /// Of the columns that touch the area; of more than four million nothing is said to be known.
  [[nodiscard]] AreaHeight max_height(const Area& area) const noexcept;
  /// May the load go along that path? Never clear unless status().valid, and
  /// .complete within the last half second.
  [[nodiscard]] Clearance clearance(const ClearanceQuery& query) const noexcept;
  /// Voxels held here: occupied and free.
  struct VoxelCount {
    std::uint64_t occupied = 0, free = 0;
  };
  [[nodiscard]] VoxelCount count_voxels() const noexcept;
  /// Columns held here whose surface is known, and those of them whose height is a lower bound.
  struct ColumnCount {
    std::uint64_t known = 0, lower_bounds = 0;
  };
  [[nodiscard]] ColumnCount count_columns() const noexcept;
  /// As the mapper has them, active or not.
  [[nodiscard]] std::vector<Zone> zones() const noexcept;

  /// Called after each batch of changes, by the thread that follows the map: it may ask this map
  /// anything, and should be quick. One callback; an empty one ends it. When this returns, the old
  /// one is not running any more (unless called from within it). What it throws ends there. False
  /// without memory for it: then none is called.
  bool on_update(std::function<void(const Update&)> callback) noexcept;

  /// Writes what is held as OctoMap's .bt file; false and the reason in `error` when that fails.
  [[nodiscard]] bool save_bt(const std::string& path, std::string& error) const noexcept;

 private:
  struct Impl;
  explicit Map(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace crane::client
