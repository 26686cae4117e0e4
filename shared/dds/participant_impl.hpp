// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/subscriber/SubscriberListener.hpp>
#include <map>
#include <mutex>
#include <set>
#include <string>

#include "base/wakeup.hpp"
#include "dds/guarded_transport.hpp"
#include "dds/participant.hpp"
#include "dds/shared_memory.hpp"

namespace crane::dds {

/// Says who is refused by DDS Security.
class RefusalLog final : public eprosima::fastdds::dds::DomainParticipantListener {
 public:
  void onParticipantAuthentication(
      eprosima::fastdds::dds::DomainParticipant* participant,
      eprosima::fastrtps::rtps::ParticipantAuthenticationInfo&& info) override;
};

/// Told of all data of a subscriber instead of its readers. Without it a host that listens to its
/// whole participant would be told of ours.
class DataBell final : public eprosima::fastdds::dds::SubscriberListener {
 public:
  void add(Wakeup* wakeup) {
    const std::lock_guard lock(mutex_);
    wakeups_.insert(wakeup);
  }
  void remove(Wakeup* wakeup) {
    const std::lock_guard lock(mutex_);
    wakeups_.erase(wakeups_.find(wakeup));
  }
  void on_data_on_readers(eprosima::fastdds::dds::Subscriber* /*subscriber*/) override {
    const std::lock_guard lock(mutex_);
    for (Wakeup* wakeup : wakeups_) wakeup->notify();
  }

 private:
  std::mutex mutex_;
  std::multiset<Wakeup*> wakeups_;  ///< one a reader
};

struct Participant::Impl {
  RefusalLog refusals;
  Settings settings;
  bool zero_copy = true;           ///< data-sharing may be used
  TimeNs certificate_expires = 0;  ///< 0 without DDS Security
  eprosima::fastdds::dds::DomainParticipant* participant = nullptr;
  eprosima::fastdds::dds::Publisher* publisher = nullptr;
  eprosima::fastdds::dds::Subscriber* subscriber = nullptr;
  std::mutex mutex;
  std::map<std::string, eprosima::fastdds::dds::Topic*> topics;
  // Of one within a host.
  bool hosted = false;
  DataBell bell;
  std::set<std::string> types;  ///< registered by us
  eprosima::fastrtps::rtps::GUID_t host;
  eprosima::fastrtps::rtps::InstanceHandle_t ours;  ///< the subscriber
  HeldFile segments;                                ///< where shared memory is used
  ShmPort shm_port;
  std::shared_ptr<GuardCounts> guard = std::make_shared<GuardCounts>();
};

}  // namespace crane::dds
