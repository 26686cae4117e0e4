#pragma once

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <map>
#include <mutex>
#include <string>

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
  HeldFile segments;  ///< where shared memory is used
  ShmPort shm_port;
  std::shared_ptr<GuardCounts> guard = std::make_shared<GuardCounts>();
};

}  // namespace crane::dds
