#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace crane::dds {

/// How samples travel. Never touches a topic's QoS.
enum class Transport {
  kAuto,  ///< zero-copy on one host where both ends can, else shared memory, else UDP
  kUdp,   ///< UDP only
};

/// How a process joins the plant's DDS network.
struct Settings {
  std::uint32_t crane = 1;   ///< partition "crane_<n>" keeps cranes apart
  bool partition = true;     ///< false: in no partition, as ROS 2 is
  std::uint32_t domain = 0;  ///< 0..232
  Transport transport = Transport::kAuto;
  /// IPv4 addresses to use; empty = all. The default keeps everything on this host.
  std::vector<std::string> interfaces = {"127.0.0.1"};
  std::uint32_t shm_segment_bytes = 64U << 20U;
  std::uint32_t udp_buffer_bytes = 4U << 20U;
  bool guard_datagrams = true;  ///< false only to show what happens without
  /// Standard Fast DDS XML file and participant profile; replaces the transport settings above.
  std::string profile_file, profile_name;
};

}  // namespace crane::dds
