// SPDX-License-Identifier: Apache-2.0
#include "dds/observer.hpp"

#include <fastdds/rtps/participant/ParticipantDiscoveryInfo.h>
#include <fastdds/rtps/reader/ReaderDiscoveryInfo.h>
#include <fastdds/rtps/writer/WriterDiscoveryInfo.h>

#include <algorithm>
#include <map>
#include <mutex>
#include <set>
#include <sstream>

#include "dds/participant_impl.hpp"
#include "dds/topics.hpp"

namespace crane::dds {
namespace {

namespace fdds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;
using eprosima::fastrtps::Duration_t;

struct Contract {
  QosSpec qos;
  std::string type;
};

/// Of every topic, by name. Types are named as their topics: map_tile is crane::v1::MapTile.
std::map<std::string, Contract> contracts() {
  std::map<std::string, Contract> out;
  const auto add = [&out]<class Topic>(Topic) {
    const std::string name = Topic::kName;
    std::string type = "crane::v1::";
    bool upper = true;
    for (const char c : name.substr(name.rfind('/') + 1)) {
      if (c != '_') type += upper ? static_cast<char>(c - 'a' + 'A') : c;
      upper = c == '_';
    }
    out[name] = {Topic::kQos, type};
  };
  std::apply([&add](auto... topics) { (add(topics), ...); }, AllTopics{});
  return out;
}

/// A tenth is how much more our readers ask for than writers offer.
bool longer(const Duration_t& period, int than_ms) {
  return than_ms > 0 && double(period.to_ns()) * 1e-6 > 1.1 * than_ms + 1;
}

}  // namespace

struct NetworkObserver::Impl final : fdds::DomainParticipantListener {
  Settings settings;
  std::map<std::string, Contract> topics = contracts();
  mutable std::mutex mutex;
  std::map<std::string, Peer> peers;
  std::set<std::string> mismatches;
  std::shared_ptr<Participant> joined;  ///< last: it ends before what it tells

  static std::string text(const rtps::GuidPrefix_t& prefix) {
    std::ostringstream s;
    s << prefix;
    return s.str();
  }

  void on_participant_discovery(fdds::DomainParticipant* /*participant*/,
                                rtps::ParticipantDiscoveryInfo&& found) override {
    const std::lock_guard lock(mutex);
    const std::string guid = text(found.info.m_guid.guidPrefix);
    peers[guid].guid = guid;
    peers[guid].name = found.info.m_participantName.c_str();
  }
  void onParticipantAuthentication(fdds::DomainParticipant* /*participant*/,
                                   rtps::ParticipantAuthenticationInfo&& info) override {
    const std::lock_guard lock(mutex);
    const std::string guid = text(info.guid.guidPrefix);
    peers[guid].guid = guid;
    peers[guid].refused =
        info.status != rtps::ParticipantAuthenticationInfo::AUTHORIZED_PARTICIPANT;
  }

  template <class Data>
  void look(const Data& data, bool writer) {
    const std::string topic = data.topicName().c_str();
    if (topic.rfind("crane/", 0) != 0) return;
    const std::lock_guard lock(mutex);
    const std::string guid = text(data.guid().guidPrefix);
    const auto peer = peers.find(guid);
    const std::string who =
        (peer == peers.end() || peer->second.name.empty() ? guid : peer->second.name) +
        (writer ? " writes " : " reads ") + topic;
    const auto say = [&](const std::string& why) { mismatches.insert(who + ": " + why); };
    const auto contract = topics.find(topic);
    if (contract == topics.end()) return say("no such topic in this version");
    const QosSpec& q = contract->second.qos;
    if (contract->second.type != data.typeName().c_str())
      say("its type is " + std::string(data.typeName().c_str()) + ", not " + contract->second.type);
    const auto partitions = data.m_qos.m_partition.names();
    const std::string ours = "crane_" + std::to_string(settings.crane);
    if (std::none_of(partitions.begin(), partitions.end(),
                     [](const std::string& p) { return p.rfind("crane_", 0) == 0 || p == "*"; }))
      say("it is in no partition crane_<number>: it is to be in " + ours);
    const bool transient = data.m_qos.m_durability.kind != fdds::VOLATILE_DURABILITY_QOS;
    if (writer && q.transient_local && !transient)
      say("it is volatile, readers ask for transient-local");
    if (!writer && !q.transient_local && transient)
      say("it asks for transient-local, writers are volatile");
    if (writer && q.reliable && data.m_qos.m_reliability.kind != fdds::RELIABLE_RELIABILITY_QOS)
      say("it is best effort, readers ask for reliable");
    const bool exclusive = data.m_qos.m_ownership.kind == fdds::EXCLUSIVE_OWNERSHIP_QOS;
    if (exclusive != q.exclusive)
      say(std::string("its ownership is ") + (exclusive ? "exclusive" : "shared") + ", not " +
          (q.exclusive ? "exclusive" : "shared"));
    if (writer && longer(data.m_qos.m_deadline.period, q.deadline_ms))
      say("its deadline is longer than " + std::to_string(q.deadline_ms) + " ms");
    if (writer && longer(data.m_qos.m_liveliness.lease_duration, q.liveliness_ms))
      say("its liveliness lease is longer than " + std::to_string(q.liveliness_ms) + " ms");
  }
  void on_subscriber_discovery(fdds::DomainParticipant* /*participant*/,
                               rtps::ReaderDiscoveryInfo&& found) override {
    if (found.status == rtps::ReaderDiscoveryInfo::DISCOVERED_READER) look(found.info, false);
  }
  void on_publisher_discovery(fdds::DomainParticipant* /*participant*/,
                              rtps::WriterDiscoveryInfo&& found) override {
    if (found.status == rtps::WriterDiscoveryInfo::DISCOVERED_WRITER) look(found.info, true);
  }
};

NetworkObserver::NetworkObserver(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

NetworkObserver::~NetworkObserver() = default;

const std::shared_ptr<Participant>& NetworkObserver::participant() const {
  return impl_->joined;
}

Result<std::unique_ptr<NetworkObserver>> NetworkObserver::create(const Settings& settings) {
  auto impl = std::make_unique<Impl>();
  impl->settings = settings;
  auto joined = Participant::create(settings, "cranemap-doctor", impl.get());
  if (!joined) return joined.error();
  impl->joined = *joined;
  return std::unique_ptr<NetworkObserver>(new NetworkObserver(std::move(impl)));
}

std::vector<NetworkObserver::Peer> NetworkObserver::peers() const {
  const std::lock_guard lock(impl_->mutex);
  std::vector<Peer> out;
  for (const auto& [guid, peer] : impl_->peers) out.push_back(peer);
  return out;
}

std::vector<std::string> NetworkObserver::mismatches() const {
  const std::lock_guard lock(impl_->mutex);
  return {impl_->mismatches.begin(), impl_->mismatches.end()};
}

}  // namespace crane::dds
