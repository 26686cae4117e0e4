// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <mutex>
#include <string>
#include <utility>

#include "base/result.hpp"
#include "crane/client/map.hpp"

namespace crane::gateway {

/// The map as files: "bt", "ot" (OctoMap), "pcd", "ply" (middles of occupied voxels). Made one at a
/// time, kept as long as the map does not change. Any thread.
class MapFiles {
 public:
  explicit MapFiles(const client::Map& map) : map_(map) {}
  /// Error: Resource; NotAvailable for a map without a surface, or while another one is being made.
  Result<std::string> get(const std::string& kind);

 private:
  Result<std::string> make(const std::string& kind) const;

  const client::Map& map_;
  std::mutex mutex_;
  std::pair<std::uint64_t, std::uint64_t> of_;  ///< map and revision of what is kept
  std::map<std::string, std::string> kept_;
};

}  // namespace crane::gateway
