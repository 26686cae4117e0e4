// SPDX-License-Identifier: Apache-2.0
#include "dds/network.hpp"

#include <fastdds/rtps/attributes/ServerAttributes.h>
#include <fastdds/rtps/transport/TransportInterface.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastdds/rtps/transport/shared_mem/SharedMemTransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>

#include <algorithm>
#include <charconv>
#include <fastdds/dds/domain/qos/DomainParticipantQos.hpp>
#include <string>

#include "base/log.hpp"
#include "dds/host_checks.hpp"

namespace crane::dds {
namespace {

namespace ert = eprosima::fastdds::rtps;
namespace rtps = eprosima::fastrtps::rtps;
using eprosima::fastrtps::Duration_t;
using rtps::IPLocator;

/// Participants of a host that a peer's address reaches.
constexpr std::uint32_t kParticipantsPerHost = 32;

/// Of "host" or "host:port".
Result<rtps::Locator_t> locator(const std::string& text, const char* key) {
  const auto address = resolve_ipv4(text, std::string("dds.") + key);
  if (!address) return address.error();
  int port = 0;
  if (const auto colon = text.rfind(':'); colon != std::string::npos)
    std::from_chars(text.data() + colon + 1, text.data() + text.size(), port);
  rtps::Locator_t out;
  out.kind = LOCATOR_KIND_UDPv4;
  IPLocator::setIPv4(out, *address);
  out.port = static_cast<std::uint32_t>(port);
  return out;
}

/// As 'fastdds discovery -i <id>' has it.
rtps::GuidPrefix_t server_prefix(int id) {
  static constexpr rtps::octet kBytes[12] = {0x44, 0x53, 0,    0x5f, 0x45, 0x50,
                                             0x52, 0x4f, 0x53, 0x49, 0x4d, 0x41};
  rtps::GuidPrefix_t prefix;
  std::copy(std::begin(kBytes), std::end(kBytes), prefix.value);
  prefix.value[2] = static_cast<rtps::octet>(id);
  return prefix;
}

/// A server is one by its id; the others ask the servers who is there.
Result<void> set_servers(const Settings& settings,
                         eprosima::fastdds::dds::WireProtocolConfigQos& protocol) {
  auto& discovery = protocol.builtin.discovery_config;
  discovery.discoveryProtocol = settings.server_id >= 0 ? rtps::DiscoveryProtocol_t::SERVER
                                                        : rtps::DiscoveryProtocol_t::CLIENT;
  discovery.discoveryServer_client_syncperiod = Duration_t(0.25);
  Result<void> found = Error{ErrorCode::kResource, "dds.servers", "none has an address", ""};
  for (std::size_t i = 0; i < settings.servers.size(); ++i) {
    const int id = static_cast<int>(i);
    const auto at = locator(settings.servers[i], "servers");
    if (!at && id == settings.server_id) return at.error();
    if (!at) {  // one is enough: its host may be down
      log_warning(at.error().text());
      continue;
    }
    found = {};
    if (id == settings.server_id) {
      protocol.prefix = server_prefix(id);
      // On all of this host's addresses: the name may be one that only others see, of a service.
      rtps::Locator_t any = *at;
      IPLocator::setIPv4(any, "0.0.0.0");
      protocol.builtin.metatrafficUnicastLocatorList.push_back(any);
      continue;
    }
    if (settings.server_id >= 0) continue;  // servers do not need each other: clients ask them all
    rtps::RemoteServerAttributes server;
    server.guidPrefix = server_prefix(id);
    server.metatrafficUnicastLocatorList.push_back(*at);
    discovery.m_DiscoveryServers.push_back(server);
  }
  return found;
}

}  // namespace

Result<void> set_network(eprosima::fastdds::dds::DomainParticipantQos& qos,
                         const Settings& settings, std::uint32_t shm_port) {
  if (auto known = check_interfaces(settings.interfaces); !known) return known;
  auto& transports = qos.transport().user_transports;
  qos.transport().use_builtin_transports = false;
  auto udp = std::make_shared<ert::UDPv4TransportDescriptor>();
  udp->sendBufferSize = settings.udp_buffer_kib << 10U;
  udp->receiveBufferSize = settings.udp_buffer_kib << 10U;
  udp->interfaceWhiteList = settings.interfaces;
  udp->maxInitialPeersRange = kParticipantsPerHost;
  transports.push_back(udp);
  if (settings.uses_shared_memory()) {
    auto shm = std::make_shared<ert::SharedMemTransportDescriptor>();
    shm->segment_size(settings.shm_segment_mib << 20U);
    shm->port_queue_capacity(1024);
    shm->healthy_check_timeout_ms(150);
    transports.push_back(shm);
    auto& data = qos.wire_protocol().default_unicast_locator_list;
    const std::unique_ptr<ert::TransportInterface> maker(shm->create_transport());
    maker->getDefaultUnicastLocators(data, shm_port);
    rtps::Locator_t by_rule;  // port 0: that of domain and participant
    by_rule.kind = LOCATOR_KIND_UDPv4;
    data.push_back(by_rule);
  }
  auto& builtin = qos.wire_protocol().builtin;
  builtin.discovery_config.leaseDuration = Duration_t(5.0);
  builtin.discovery_config.leaseDuration_announcementperiod = Duration_t(0.5);
  builtin.discovery_config.initial_announcements.count = 20;
  builtin.discovery_config.initial_announcements.period = Duration_t(0.1);
  for (const std::string& peer : settings.peers) {
    auto at = locator(peer, "peers");
    if (!at) return at.error();
    builtin.initialPeersList.push_back(*at);
  }
  if (settings.server_id >= 0) return set_servers(settings, qos.wire_protocol());
  rtps::Locator_t unicast;
  unicast.kind = LOCATOR_KIND_UDPv4;
  builtin.metatrafficUnicastLocatorList.push_back(unicast);
  if (!settings.servers.empty()) return set_servers(settings, qos.wire_protocol());
  if (settings.network == Settings::Network::kPlant) return {};
  rtps::Locator_t multicast;
  multicast.kind = LOCATOR_KIND_UDPv4;
  IPLocator::setIPv4(multicast, "239.255.0.1");
  builtin.metatrafficMulticastLocatorList.push_back(multicast);
  // Initial peers replace the group unless it is one of them.
  if (!settings.peers.empty()) builtin.initialPeersList.push_back(multicast);
  return {};
}

}  // namespace crane::dds
