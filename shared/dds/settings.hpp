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
  bool multicast = true;  ///< participants find each other by multicast
  /// Discovery servers "host:port" instead of multicast; number n of the list has n as its id.
  std::vector<std::string> servers;
  int server_id = -1;              ///< this participant is that discovery server; -1 = none
  std::vector<std::string> peers;  ///< further hosts to announce ourselves to
  /// DDS Security: a folder of certificates and permissions, see deploy/security; empty = off.
  std::string security;
  std::string identity;  ///< who this is, of that folder
  std::uint32_t shm_segment_bytes = 64U << 20U;
  std::uint32_t udp_buffer_bytes = 4U << 20U;
  /// We are a library in somebody else's program: its Fast DDS log and library settings are its
  /// own.
  bool guest = false;
  bool guard_datagrams = true;  ///< false only to show what happens without
  /// Standard Fast DDS XML file and participant profile; replaces the transport, discovery and
  /// security settings above.
  std::string profile_file, profile_name;
};

/// Whether samples may be shared without a copy: DDS Security keeps Fast DDS from it.
inline bool zero_copy(const Settings& settings) {
  return settings.transport != Transport::kUdp && settings.security.empty();
}

}  // namespace crane::dds
