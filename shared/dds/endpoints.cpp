// SPDX-License-Identifier: Apache-2.0
#include "dds/endpoints.hpp"

#include <atomic>
#include <fastdds/dds/core/LoanableSequence.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <map>
#include <mutex>
#include <string>
#include <utility>

#include "base/log.hpp"
#include "clearance_replyPubSubTypes.h"
#include "clearance_requestPubSubTypes.h"
#include "dds/in_place_type.hpp"
#include "dds/validate.hpp"
#include "dds/writer_impl.hpp"
#include "height_tilePubSubTypes.h"
#include "hoist_statePubSubTypes.h"
#include "map_statusPubSubTypes.h"
#include "map_tilePubSubTypes.h"
#include "octree_mapPubSubTypes.h"
#include "rangefinder_positionPubSubTypes.h"
#include "service_statusPubSubTypes.h"
#include "tile_requestPubSubTypes.h"
#include "zone_commandPubSubTypes.h"
#include "zone_setPubSubTypes.h"

namespace crane::dds {
#define CRANE_SUPPORT(T)                  \
  template <>                             \
  struct Support<v1::T> {                 \
    using PubSubType = v1::T##PubSubType; \
  }
CRANE_SUPPORT(RangefinderPosition);
CRANE_SUPPORT(HoistState);
CRANE_SUPPORT(MapTile);
CRANE_SUPPORT(HeightTile);
CRANE_SUPPORT(OctreeMap);
CRANE_SUPPORT(MapStatus);
CRANE_SUPPORT(TileRequest);
CRANE_SUPPORT(ZoneSet);
CRANE_SUPPORT(ZoneCommand);
CRANE_SUPPORT(ClearanceRequest);
CRANE_SUPPORT(ClearanceReply);
CRANE_SUPPORT(ServiceStatus);
#undef CRANE_SUPPORT
template <>
struct Support<StereoFrame> {
  using PubSubType = InPlaceType<StereoFrame>;
};
template <>
struct Support<PartialCloud> {
  using PubSubType = InPlaceType<PartialCloud>;
};

namespace {

/// A writer's handle begins with the number of its participant.
ParticipantId participant_of(const rtps::InstanceHandle_t& handle) {
  ParticipantId id;
  for (std::size_t i = 0; i < id.size(); ++i) id[i] = handle.value[i];
  return id;
}

}  // namespace

// ---------------------------------------------------------------- received samples

template <class Type>
struct Received<Type>::State {
  fdds::DataReader* reader = nullptr;
  FASTDDS_SEQUENCE(Samples, Type);
  Samples samples;
  fdds::SampleInfoSeq infos;

  ~State() {
    if (infos.length() > 0) reader->return_loan(samples, infos);
  }
};

template <class Type>
Received<Type>::Received(std::unique_ptr<State> state) : state_(std::move(state)) {}
template <class Type>
Received<Type>::~Received() = default;
template <class Type>
Received<Type>::Received(Received&&) noexcept = default;
template <class Type>
Received<Type>& Received<Type>::operator=(Received&&) noexcept = default;

template <class Type>
const Type& Received<Type>::operator*() const {
  return std::as_const(state_->samples)[0];
}

template <class Type>
bool Received<Type>::intact() const {
  const void* at = &state_->samples[0];
  if constexpr (kInPlace<Type>) at = state_->samples[0].body();
  return state_->reader->is_sample_valid(at, &state_->infos[0]);
}

template <class Type>
bool Received<Type>::disposed() const {
  return !state_->infos[0].valid_data;
}

template <class Type>
InstanceKey Received<Type>::key() const {
  InstanceKey key;
  const auto& handle = state_->infos[0].instance_handle;
  for (std::size_t i = 0; i < key.size(); ++i) key[i] = handle.value[i];
  return key;
}

template <class Type>
ParticipantId Received<Type>::writer() const {
  return participant_of(state_->infos[0].publication_handle);
}

template <class Type>
TimeNs Received<Type>::source_time_ns() const {
  return state_->infos[0].source_timestamp.to_ns();
}

// ---------------------------------------------------------------- reader

template <class Topic>
struct Reader<Topic>::Impl : fdds::DataReaderListener {
  std::shared_ptr<Participant> participant;
  fdds::DataReader* reader = nullptr;
  Wakeup* wakeup = nullptr;
  std::uint64_t received = 0, invalid = 0;
  std::atomic<std::uint64_t> lost{0}, rejected{0};
  std::atomic<int> matched{0};
  std::atomic<TimeNs> told_ns{0};
  std::mutex mutex;
  std::map<ParticipantId, TimeNs> writers;

  void on_data_available(fdds::DataReader* /*reader*/) override {
    told_ns = SystemClock().now();
    if (wakeup != nullptr) wakeup->notify();
  }
  void on_requested_incompatible_qos(fdds::DataReader* /*reader*/,
                                     const fdds::RequestedIncompatibleQosStatus& status) override {
    log_warning(std::string(Topic::kName) + ": a writer is not heard, its " +
                policy_name(status.last_policy_id) + " does not fit; see 'cranemap doctor'");
  }
  void on_sample_lost(fdds::DataReader* /*reader*/, const fdds::SampleLostStatus& status) override {
    lost = std::uint64_t(status.total_count);
  }
  void on_sample_rejected(fdds::DataReader* /*reader*/,
                          const fdds::SampleRejectedStatus& status) override {
    rejected = std::uint64_t(status.total_count);
  }
  void on_subscription_matched(fdds::DataReader* /*reader*/,
                               const fdds::SubscriptionMatchedStatus& status) override {
    matched = status.current_count;
    const ParticipantId who = participant_of(status.last_publication_handle);
    const std::lock_guard lock(mutex);
    if (status.current_count_change > 0)
      writers.try_emplace(who, MonotonicClock().now());
    else
      writers.erase(who);
  }
  ~Impl() override {
    if (participant->impl().hosted && wakeup != nullptr) participant->impl().bell.remove(wakeup);
    if (reader == nullptr || participant->ended()) return;
    reader->set_listener(nullptr);
    participant->impl().subscriber->delete_datareader(reader);
  }
};

template <class Topic>
Reader<Topic>::Reader(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
template <class Topic>
Reader<Topic>::~Reader() = default;
template <class Topic>
Reader<Topic>::Reader(Reader&&) noexcept = default;

template <class Topic>
Result<Reader<Topic>> Reader<Topic>::create(const std::shared_ptr<Participant>& participant,
                                            Wakeup* wakeup) {
  auto topic = topic_of<Topic>(participant->impl(), Topic::kName);
  if (!topic) return topic.error();
  if constexpr (kInPlace<Type>)
    if (!in_place_type<Type>(*topic)->take_role(InPlaceType<Type>::Role::kReader, Type::kMost))
      return one_role(Topic::kName);
  auto impl = std::make_unique<Impl>();
  impl->participant = participant;
  impl->wakeup = wakeup;
  if (participant->impl().hosted && wakeup != nullptr) participant->impl().bell.add(wakeup);
  fdds::DataReaderQos qos;
  apply(Topic::kQos, participant->impl().zero_copy, qos);
  if constexpr (kInPlace<Type>) take_memory_as_needed(qos);
  // A tenth more than writers offer: vendors round fractions of a second differently, and a
  // nanosecond too much would keep a writer of another one apart.
  if (Topic::kQos.deadline_ms > 0)
    qos.deadline().period = seconds(Topic::kQos.deadline_ms * 11 / 10);
  if (Topic::kQos.liveliness_ms > 0)
    qos.liveliness().lease_duration = seconds(Topic::kQos.liveliness_ms * 11 / 10);
  impl->reader = participant->impl().subscriber->create_datareader(*topic, qos, impl.get());
  if (impl->reader == nullptr)
    return Error{ErrorCode::kResource, Topic::kName, "the reader could not be made",
                 "see the Fast DDS message above"};
  return Reader(std::move(impl));
}

template <class Topic>
std::unique_ptr<Received<typename Topic::Type>> Reader<Topic>::take() {
  for (;;) {
    auto state = std::make_unique<typename Received<Type>::State>();
    state->reader = impl_->reader;
    if (impl_->reader->take(state->samples, state->infos, 1) != ReturnCode::RETCODE_OK)
      return nullptr;
    if (!state->infos[0].valid_data) {
      if (Topic::kQos.disposes &&
          state->infos[0].instance_state == fdds::NOT_ALIVE_DISPOSED_INSTANCE_STATE)
        return std::make_unique<Received<Type>>(std::move(state));
      continue;
    }
    if (const char* what = flaw(std::as_const(state->samples)[0]); what != nullptr) {
      if (++impl_->invalid == 1 || impl_->invalid % 1000 == 0)
        log_warning(std::string(Topic::kName) + ": sample refused: " + what + " (" +
                    std::to_string(impl_->invalid) + " so far)");
      continue;
    }
    ++impl_->received;
    return std::make_unique<Received<Type>>(std::move(state));
  }
}

template <class Topic>
ReaderCounts Reader<Topic>::counts() const {
  return {impl_->received, impl_->invalid, impl_->lost + impl_->rejected, impl_->matched,
          impl_->told_ns};
}

template <class Topic>
std::map<ParticipantId, TimeNs> Reader<Topic>::writers() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->writers;
}

#define CRANE_ENDPOINTS(T)          \
  template class Received<T::Type>; \
  template class Reader<T>;         \
  template class Writer<T>
CRANE_ENDPOINTS(StereoFrameTopic);
CRANE_ENDPOINTS(RangefinderPositionTopic);
CRANE_ENDPOINTS(HoistStateTopic);
CRANE_ENDPOINTS(PartialCloudTopic);
CRANE_ENDPOINTS(MapTileTopic);
CRANE_ENDPOINTS(HeightTileTopic);
CRANE_ENDPOINTS(OctreeMapTopic);
CRANE_ENDPOINTS(MapStatusTopic);
CRANE_ENDPOINTS(TileRequestTopic);
CRANE_ENDPOINTS(ZoneSetTopic);
CRANE_ENDPOINTS(ZoneCommandTopic);
CRANE_ENDPOINTS(ClearanceRequestTopic);
CRANE_ENDPOINTS(ClearanceReplyTopic);
CRANE_ENDPOINTS(ServiceStatusTopic);
#undef CRANE_ENDPOINTS

}  // namespace crane::dds
