// SPDX-License-Identifier: Apache-2.0
#include "dds/hosted.hpp"

#include <algorithm>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <string>

namespace crane::dds {

namespace fdds = eprosima::fastdds::dds;

Result<std::shared_ptr<Participant>> Participant::within(fdds::DomainParticipant& host,
                                                         std::uint32_t crane) {
  if (!host.is_enabled())
    return Error{ErrorCode::kConfiguration, "the participant that is given", "is not enabled",
                 "call its enable() first"};
  auto impl = std::make_unique<Impl>();
  impl->hosted = true;
  impl->settings.crane = crane;
  impl->settings.domain = host.get_domain_id();
  impl->zero_copy = false;  // it may have no shared memory, or DDS Security
  impl->participant = &host;
  impl->host = host.guid();

  const std::string partition = "crane_" + std::to_string(crane);
  fdds::PublisherQos publisher_qos;
  publisher_qos.partition().push_back(partition.c_str());
  impl->publisher = host.create_publisher(publisher_qos, nullptr, fdds::StatusMask::none());
  fdds::SubscriberQos subscriber_qos;
  subscriber_qos.partition().push_back(partition.c_str());
  impl->subscriber =
      host.create_subscriber(subscriber_qos, &impl->bell, fdds::StatusMask::data_on_readers());
  if (impl->publisher == nullptr || impl->subscriber == nullptr) {
    leave_host(*impl, false);
    return Error{ErrorCode::kResource, "the participant that is given",
                 "no publisher or subscriber could be made in it",
                 "see the Fast DDS message above"};
  }
  impl->ours = impl->subscriber->get_instance_handle();
  return std::shared_ptr<Participant>(new Participant(std::move(impl)));
}

bool Participant::ended() const {
  if (!impl_->hosted) return false;
  const auto there =
      fdds::DomainParticipantFactory::get_instance()->lookup_participants(impl_->settings.domain);
  if (std::find(there.begin(), there.end(), impl_->participant) == there.end()) return true;
  // Another one may stand where it was, or have been emptied by delete_contained_entities().
  return impl_->participant->guid() != impl_->host ||
         !impl_->participant->contains_entity(impl_->ours, false);
}

fdds::DomainParticipant& Participant::fast_dds() const {
  return *impl_->participant;
}

void leave_host(Participant::Impl& impl, bool ended) {
  if (ended) return;
  if (impl.publisher != nullptr) impl.participant->delete_publisher(impl.publisher);
  if (impl.subscriber != nullptr) impl.participant->delete_subscriber(impl.subscriber);
  for (const auto& [name, topic] : impl.topics)
    if (topic != nullptr) impl.participant->delete_topic(topic);
  for (const std::string& type : impl.types)
    impl.participant->unregister_type(type);  // refused while another map within it has it
}

}  // namespace crane::dds
