// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "crane/client/map.hpp"
#include "map_sync/map_follower.hpp"

namespace crane::client {

/// What a follower knows, in the words of the library. The caller holds its mutex.
Status status_of(const MapFollower& follower);
std::vector<Zone> zones_of(const MapFollower& follower);

}  // namespace crane::client
