// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "crane/network.hpp"

namespace crane::dds {

/// How a process joins the plant's DDS network. Never touches a topic's QoS. With shared memory
/// samples travel without a copy where both ends can, else through it, else by UDP.
struct Settings : NetworkSettings {
  std::uint32_t crane = 1;  ///< partition "crane_<n>" keeps cranes apart
  bool partition = true;    ///< false: in no partition, as ROS 2 is
  int server_id = -1;       ///< this participant is that one of `servers`; -1 = none
  /// We are a library in somebody else's program: its Fast DDS log and library settings are its
  /// own.
  bool guest = false;
  bool guard_datagrams = true;  ///< false only to show what happens without
};

/// Whether samples may be shared without a copy: DDS Security keeps Fast DDS from it.
inline bool zero_copy(const Settings& settings) {
  return settings.uses_shared_memory() && settings.security.empty();
}

}  // namespace crane::dds
