// SPDX-License-Identifier: Apache-2.0
#pragma once

// What endpoints.cpp and ros2_endpoints.cpp are made of; only they include it.

#include <algorithm>
#include <atomic>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <memory>
#include <string>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/log.hpp"
#include "dds/endpoints.hpp"
#include "dds/guarded_type.hpp"
#include "dds/in_place_type.hpp"
#include "dds/participant_impl.hpp"
#include "dds/shared_memory.hpp"

namespace crane::dds {

namespace fdds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;
using eprosima::fastrtps::Duration_t;
using ReturnCode = eprosima::fastrtps::types::ReturnCode_t;

/// The generated type support of a type.
template <class Type>
struct Support;

inline Duration_t seconds(int ms) {
  return Duration_t(double(ms) * 1e-3);
}

inline std::string policy_name(fdds::QosPolicyId_t id) {
  switch (id) {
    case fdds::RELIABILITY_QOS_POLICY_ID:
      return "reliability";
    case fdds::DURABILITY_QOS_POLICY_ID:
      return "durability";
    case fdds::OWNERSHIP_QOS_POLICY_ID:
      return "ownership";
    case fdds::DEADLINE_QOS_POLICY_ID:
      return "deadline";
    case fdds::LIVELINESS_QOS_POLICY_ID:
      return "liveliness";
    default:
      return "QoS policy " + std::to_string(int(id));
  }
}

/// The part of the QoS that readers and writers share.
template <class Qos>
void apply(const QosSpec& spec, bool zero_copy, Qos& qos) {
  qos.reliability().kind =
      spec.reliable ? fdds::RELIABLE_RELIABILITY_QOS : fdds::BEST_EFFORT_RELIABILITY_QOS;
  qos.durability().kind =
      spec.transient_local ? fdds::TRANSIENT_LOCAL_DURABILITY_QOS : fdds::VOLATILE_DURABILITY_QOS;
  qos.history().kind = fdds::KEEP_LAST_HISTORY_QOS;
  qos.history().depth = spec.depth;
  qos.resource_limits().max_instances = spec.max_instances;
  qos.resource_limits().max_samples_per_instance = spec.depth;
  qos.resource_limits().max_samples = spec.max_instances * spec.depth;
  qos.resource_limits().allocated_samples = spec.big || spec.unbounded ? 1 : spec.depth;
  // With the dynamic policy a sample takes the memory that it needs, but a reader with it cannot
  // take the end of an instance, which has no payload, and waits for it for ever.
  constexpr bool kWriter = std::is_same_v<Qos, fdds::DataWriterQos>;
  qos.endpoint().history_memory_policy = spec.unbounded || (spec.big && kWriter)
                                             ? rtps::DYNAMIC_REUSABLE_MEMORY_MODE
                                             : rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  if (spec.exclusive) qos.ownership().kind = fdds::EXCLUSIVE_OWNERSHIP_QOS;
  if (spec.deadline_ms > 0) qos.deadline().period = seconds(spec.deadline_ms);
  if (spec.lifespan_ms > 0) qos.lifespan().duration = seconds(spec.lifespan_ms);
  if (spec.liveliness_ms > 0) qos.liveliness().lease_duration = seconds(spec.liveliness_ms);
  if (zero_copy && spec.zero_copy)
    qos.data_sharing().on("");
  else
    qos.data_sharing().off();
}

/// Registered by us, now or before: within a host somebody else's may be there.
template <class Type>
Result<std::string> type_of(Participant::Impl& p) {
  // Of the maps within a host each has a crane of its own, and one type.
  const bool one_crane = p.settings.partition && !p.hosted;
  fdds::TypeSupport type(new Type(one_crane ? p.settings.crane : 0));
  const std::string name = type.get_type_name();
  const fdds::TypeSupport there = p.participant->find_type(name);
  if (!there.empty() && dynamic_cast<const Type*>(there.get()) == nullptr)
    return Error{ErrorCode::kConfiguration, "the participant that is given",
                 "has a type '" + name + "' of its own, which malformed samples could break",
                 "give a participant that does not use that topic, or none"};
  if (there.empty()) {
    type.register_type(p.participant);
    p.types.insert(name);
  }
  return name;
}

template <class Topic>
Result<fdds::Topic*> topic_of(Participant::Impl& p, const std::string& name) {
  using Type = GuardedType<typename Support<typename Topic::Type>::PubSubType>;
  const std::lock_guard lock(p.mutex);
  fdds::Topic*& topic = p.topics[name];
  if (topic != nullptr) return topic;
  const auto type = type_of<Type>(p);
  if (!type) return type.error();
  // Another map within the same host, or the host itself, may have it.
  topic = p.participant->lookup_topicdescription(name) != nullptr
              ? p.participant->find_topic(name, Duration_t(0.0))
              : p.participant->create_topic(name, *type, fdds::TOPIC_QOS_DEFAULT);
  if (topic == nullptr) return Error{ErrorCode::kResource, name, "the topic could not be made", ""};
  if (topic->get_type_name() != *type)
    return Error{ErrorCode::kConfiguration, name,
                 "is a topic of type '" + topic->get_type_name() + "' in the participant given",
                 "give a participant that does not use that topic, or none"};
  return topic;
}

template <class Sample>
InPlaceType<Sample>* in_place_type(fdds::Topic* topic) {
  const fdds::TypeSupport type = topic->get_participant()->find_type(topic->get_type_name());
  return static_cast<InPlaceType<Sample>*>(type.get());
}

/// A payload as large as its sample, not as its bound: for samples without a key, whose instances
/// do not end.
template <class Qos>
void take_memory_as_needed(Qos& qos) {
  qos.endpoint().history_memory_policy = rtps::DYNAMIC_REUSABLE_MEMORY_MODE;
  qos.resource_limits().allocated_samples = 1;
}

inline Error one_role(const char* topic) {
  return {ErrorCode::kResource, topic, "a participant reads it or writes it, not both",
          "use a participant for each"};
}

// ---------------------------------------------------------------- writer

template <class Topic>
struct Writer<Topic>::Impl : fdds::DataWriterListener {
  std::shared_ptr<Participant> participant;
  fdds::DataWriter* writer = nullptr;
  std::atomic<int> matched{0};
  /// Of in-place samples: what was lent and not given back.
  struct Lent {
    void* memory = nullptr;
    std::unique_ptr<Type> sample;
  };
  std::vector<Lent> lent;
  std::size_t capacity = 0;

  /// The memory behind a sample, which is no longer lent out.
  void* take_back(Type* sample, std::unique_ptr<Type>& held) {
    const auto at = std::find_if(lent.begin(), lent.end(),
                                 [&](const Lent& l) { return l.sample.get() == sample; });
    expects(at != lent.end(), "was lent by this writer");
    held = std::move(at->sample);
    void* memory = at->memory;
    lent.erase(at);
    return memory;
  }

  void on_publication_matched(fdds::DataWriter* /*writer*/,
                              const fdds::PublicationMatchedStatus& status) override {
    matched = status.current_count;
  }
  void on_offered_incompatible_qos(fdds::DataWriter* /*writer*/,
                                   const fdds::OfferedIncompatibleQosStatus& status) override {
    log_warning(std::string(Topic::kName) + ": a reader is not served, its " +
                policy_name(status.last_policy_id) + " does not fit; see 'cranemap doctor'");
  }
  ~Impl() override {
    if (writer == nullptr || participant->ended()) return;
    if (Topic::kQos.zero_copy && participant->impl().zero_copy && matched > 0) {
      // Readers look into our memory, and Fast DDS unmaps it there the moment we are gone: let them
      // take what is there, and use it. (A killed writer is noticed after its lease of 5 s.)
      writer->wait_for_acknowledgments(Duration_t(0.5));
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    writer->set_listener(nullptr);
    participant->impl().publisher->delete_datawriter(writer);
  }
};

template <class Topic>
Writer<Topic>::Writer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
template <class Topic>
Writer<Topic>::~Writer() = default;
template <class Topic>
Writer<Topic>::Writer(Writer&&) noexcept = default;

template <class Topic>
Result<Writer<Topic>> Writer<Topic>::create(const std::shared_ptr<Participant>& participant,
                                            const std::string& name, int strength,
                                            std::size_t capacity) {
  auto topic = topic_of<Topic>(participant->impl(), name);
  if (!topic) return topic.error();
  auto impl = std::make_unique<Impl>();
  impl->participant = participant;
  bool zero_copy = participant->impl().zero_copy;
  if constexpr (kInPlace<Type>) {
    auto* type = in_place_type<Type>(*topic);
    if (!type->take_role(InPlaceType<Type>::Role::kWriter, capacity > 0 ? capacity : Type::kMost))
      return one_role(Topic::kName);
    impl->capacity = capacity;
    zero_copy = zero_copy && capacity > 0;
    // One more is lent out, and one written meanwhile. What is not there ends the process when it
    // is touched.
    if (zero_copy)
      if (auto room =
              check_shared_memory(std::uint64_t{type->m_typeSize} * (Topic::kQos.depth + 2));
          !room)
        return room.error();
  }
  fdds::DataWriterQos qos;
  apply(Topic::kQos, zero_copy, qos);
  if (kInPlace<Type> && capacity == 0) take_memory_as_needed(qos);
  qos.reliability().max_blocking_time = Duration_t(1.0);
  qos.ownership_strength().value = static_cast<std::uint32_t>(strength);
  if (Topic::kQos.transient_local) {
    // A late joiner asks for 256 samples at a time and hears of the next ones with a heartbeat.
    qos.reliable_writer_qos().times.heartbeatPeriod = seconds(50);
    qos.reliable_writer_qos().times.nackResponseDelay = seconds(1);
  }
  if (Topic::kQos.liveliness_ms > 0)
    qos.liveliness().announcement_period = seconds(Topic::kQos.liveliness_ms / 4);
  impl->writer = participant->impl().publisher->create_datawriter(*topic, qos, impl.get());
  if (impl->writer == nullptr)
    return Error{ErrorCode::kResource, Topic::kName, "the writer could not be made",
                 "see the Fast DDS message above"};
  return Writer(std::move(impl));
}

template <class Topic>
Result<void> Writer<Topic>::write(const Type& sample) {
  // Fast DDS takes a non-const pointer but only reads it.
  if (impl_->writer->write(const_cast<Type*>(&sample))) return {};
  return Error{ErrorCode::kResource, Topic::kName, "the sample was not accepted within 1 s",
               "a reader is stuck, or memory limits are reached"};
}

template <class Topic>
Result<void> Writer<Topic>::dispose(const Type& sample) {
  const auto done = impl_->writer->dispose(const_cast<Type*>(&sample), rtps::InstanceHandle_t());
  if (done == ReturnCode::RETCODE_OK) return {};
  return Error{ErrorCode::kResource, Topic::kName, "an instance could not be ended", ""};
}

template <class Topic>
typename Topic::Type* Writer<Topic>::loan() {
  if (kInPlace<Type> && impl_->capacity == 0) return nullptr;
  void* memory = nullptr;
  if (impl_->writer->loan_sample(memory) != ReturnCode::RETCODE_OK) return nullptr;
  if constexpr (kInPlace<Type>) {
    auto sample = std::make_unique<Type>();
    InPlaceType<Type>::lay_out(*sample, impl_->capacity, memory);
    impl_->lent.push_back({memory, std::move(sample)});
    return impl_->lent.back().sample.get();
  } else {
    return static_cast<Type*>(memory);
  }
}

template <class Topic>
Result<void> Writer<Topic>::publish(Type* loaned) {
  if constexpr (kInPlace<Type>) {
    std::unique_ptr<Type> held;
    void* memory = impl_->take_back(loaned, held);
    const bool whole = InPlaceType<Type>::complete(*held, impl_->capacity, memory);
    // What has shrunk is copied: it is sent as small as it is. Its memory is given back before,
    // there may be no other.
    if (!whole) impl_->writer->discard_loan(memory);
    void* sample = whole ? memory : held.get();
    if (impl_->writer->write(sample)) return {};
    if (whole) impl_->writer->discard_loan(sample);
  } else {
    if (impl_->writer->write(loaned)) return {};
    discard(loaned);
  }
  return Error{ErrorCode::kResource, Topic::kName, "the sample was not accepted within 1 s",
               "a reader is stuck, or memory limits are reached"};
}

template <class Topic>
void Writer<Topic>::discard(Type* loaned) {
  void* memory = loaned;
  std::unique_ptr<Type> held;
  if constexpr (kInPlace<Type>) memory = impl_->take_back(loaned, held);
  impl_->writer->discard_loan(memory);
}

template <class Topic>
bool Writer<Topic>::wait_for_readers(std::chrono::milliseconds limit) {
  return impl_->writer->wait_for_acknowledgments(Duration_t(double(limit.count()) * 1e-3)) ==
         ReturnCode::RETCODE_OK;
}

template <class Topic>
int Writer<Topic>::matched() const {
  return impl_->matched;
}

}  // namespace crane::dds
