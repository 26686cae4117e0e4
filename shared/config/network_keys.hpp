// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "crane/network.hpp"

namespace crane {

class KeyVisitor;
/// Section `dds`.
void keys(KeyVisitor& v, NetworkSettings& c);

/// As dds.network says it.
const std::string& network_name(NetworkSettings::Network network);

}  // namespace crane
