#include "dds/endpoints.hpp"

#include <atomic>
#include <fastdds/dds/core/LoanableSequence.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>
#include <string>
#include <thread>
#include <utility>

#include "base/log.hpp"
#include "clearance_replyPubSubTypes.h"
#include "clearance_requestPubSubTypes.h"
#include "dds/guarded_type.hpp"
#include "dds/participant_impl.hpp"
#include "dds/validate.hpp"
#include "height_tilePubSubTypes.h"
#include "hoist_statePubSubTypes.h"
#include "map_statusPubSubTypes.h"
#include "map_tilePubSubTypes.h"
#include "octree_mapPubSubTypes.h"
#include "partial_cloudPubSubTypes.h"
#include "rangefinder_positionPubSubTypes.h"
#include "service_statusPubSubTypes.h"
#include "stereo_framePubSubTypes.h"
#include "tile_requestPubSubTypes.h"
#include "zone_commandPubSubTypes.h"
#include "zone_setPubSubTypes.h"

namespace crane::dds {
namespace {

namespace fdds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;
using eprosima::fastrtps::Duration_t;
using ReturnCode = eprosima::fastrtps::types::ReturnCode_t;

template <class Type>
struct Support;
#define CRANE_SUPPORT(T)                  \
  template <>                             \
  struct Support<v1::T> {                 \
    using PubSubType = v1::T##PubSubType; \
  }
CRANE_SUPPORT(StereoFrame);
CRANE_SUPPORT(RangefinderPosition);
CRANE_SUPPORT(HoistState);
CRANE_SUPPORT(PartialCloud);
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

Duration_t seconds(int ms) {
  return Duration_t(double(ms) * 1e-3);
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
  qos.resource_limits().allocated_samples = spec.big ? 1 : spec.depth;
  qos.endpoint().history_memory_policy =
      spec.big ? rtps::DYNAMIC_REUSABLE_MEMORY_MODE : rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  if (spec.deadline_ms > 0) qos.deadline().period = seconds(spec.deadline_ms);
  if (spec.lifespan_ms > 0) qos.lifespan().duration = seconds(spec.lifespan_ms);
  if (spec.liveliness_ms > 0) qos.liveliness().lease_duration = seconds(spec.liveliness_ms);
  if (zero_copy && spec.zero_copy)
    qos.data_sharing().on("");
  else
    qos.data_sharing().off();
}

template <class Topic>
Result<fdds::Topic*> topic_of(Participant::Impl& p) {
  const std::lock_guard lock(p.mutex);
  fdds::Topic*& topic = p.topics[Topic::kName];
  if (topic == nullptr) {
    fdds::TypeSupport type(new GuardedType<typename Support<typename Topic::Type>::PubSubType>());
    type.register_type(p.participant);
    topic =
        p.participant->create_topic(Topic::kName, type.get_type_name(), fdds::TOPIC_QOS_DEFAULT);
  }
  if (topic == nullptr)
    return Error{ErrorCode::kResource, Topic::kName, "the topic could not be made", ""};
  return topic;
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
  return state_->reader->is_sample_valid(&state_->samples[0], &state_->infos[0]);
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

  void on_data_available(fdds::DataReader* /*reader*/) override {
    told_ns = SystemClock().now();
    if (wakeup != nullptr) wakeup->notify();
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
  }
  ~Impl() override {
    if (reader == nullptr) return;
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
  auto topic = topic_of<Topic>(participant->impl());
  if (!topic) return topic.error();
  auto impl = std::make_unique<Impl>();
  impl->participant = participant;
  impl->wakeup = wakeup;
  fdds::DataReaderQos qos;
  apply(Topic::kQos, participant->impl().zero_copy, qos);
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

// ---------------------------------------------------------------- writer

template <class Topic>
struct Writer<Topic>::Impl : fdds::DataWriterListener {
  std::shared_ptr<Participant> participant;
  fdds::DataWriter* writer = nullptr;
  std::atomic<int> matched{0};

  void on_publication_matched(fdds::DataWriter* /*writer*/,
                              const fdds::PublicationMatchedStatus& status) override {
    matched = status.current_count;
  }
  ~Impl() override {
    if (writer == nullptr) return;
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
Result<Writer<Topic>> Writer<Topic>::create(const std::shared_ptr<Participant>& participant) {
  auto topic = topic_of<Topic>(participant->impl());
  if (!topic) return topic.error();
  auto impl = std::make_unique<Impl>();
  impl->participant = participant;
  fdds::DataWriterQos qos;
  apply(Topic::kQos, participant->impl().zero_copy, qos);
  qos.reliability().max_blocking_time = Duration_t(1.0);
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
  void* memory = nullptr;
  if (impl_->writer->loan_sample(memory) != ReturnCode::RETCODE_OK) return nullptr;
  return static_cast<Type*>(memory);
}

template <class Topic>
Result<void> Writer<Topic>::publish(Type* loaned) {
  if (impl_->writer->write(loaned)) return {};
  discard(loaned);
  return Error{ErrorCode::kResource, Topic::kName, "the sample was not accepted within 1 s",
               "a reader is stuck, or memory limits are reached"};
}

template <class Topic>
void Writer<Topic>::discard(Type* loaned) {
  void* memory = loaned;
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
