// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <map>
#include <string>

#include "base/drop_counts.hpp"
#include "crane/client/map.hpp"
#include "gateway/map_files.hpp"
#include "gateway/state_board.hpp"
#include "gateway/tile_log.hpp"
#include "http/router.hpp"

namespace crane::gateway {

/// What there is below /api/v1, as openapi.json describes it. Any thread; outlives its routes.
class Api {
 public:
  Api(const client::Map& map, const StateBoard& board, const TileLog& tiles)
      : map_(map), board_(board), tiles_(tiles), files_(map) {}

  void add_routes(http::Router& router);
  [[nodiscard]] MapFiles& files() { return files_; }

 private:
  [[nodiscard]] http::Response status() const;
  [[nodiscard]] http::Response height(const http::Request& request) const;
  [[nodiscard]] http::Response heights(const std::string& kind) const;
  [[nodiscard]] http::Response clearance(const http::Request& request);
  [[nodiscard]] http::Response zones() const;
  [[nodiscard]] http::Response file(const std::string& kind, const http::Request& request);

  const client::Map& map_;
  const StateBoard& board_;
  const TileLog& tiles_;
  MapFiles files_;
  std::atomic<int> thinking_{0};
};

}  // namespace crane::gateway
