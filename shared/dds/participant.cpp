// SPDX-License-Identifier: Apache-2.0
#include "dds/participant.hpp"

#include <fastdds/rtps/transport/TCPTransportDescriptor.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastdds/rtps/transport/shared_mem/SharedMemTransportDescriptor.h>
#include <fastrtps/xmlparser/XMLProfileManager.h>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/log/Log.hpp>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <map>
#include <sstream>
#include <utility>

#include "base/log.hpp"
#include "base/read_file.hpp"
#include "dds/host_checks.hpp"
#include "dds/hosted.hpp"
#include "dds/in_place_type.hpp"
#include "dds/network.hpp"
#include "dds/participant_impl.hpp"
#include "dds/security.hpp"
#include "dds/topics.hpp"

namespace crane::dds {
namespace {

namespace fdds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;

std::atomic<int>& participants() {
  static std::atomic<int> made{0};
  return made;
}

/// Fast DDS messages go where ours go: one place to look, and stdout stays the program's own.
class LogBridge final : public fdds::LogConsumer {
 public:
  void Consume(const fdds::Log::Entry& entry) override {
    // Said once by every participant at its first sample, and at every orderly end: of no use.
    if (entry.message.find("Buffer is being invalidated") == 0 && invalidated_++ < participants())
      return;
    if (entry.message.find("Automatically unmatching") == 0) return;
    // What the guard takes out of a message becomes padding; it has counted and told it.
    if (entry.message.find("PAD messages not yet implemented") != std::string::npos) return;
    const std::string text =
        "Fast DDS " + std::string(entry.context.category) + ": " + entry.message;
    const auto now = std::chrono::steady_clock::now();
    if (said_.size() > 64) said_.clear();
    const auto [said, first] = said_.try_emplace(text, now);
    if (!first && now - said->second < std::chrono::seconds(10)) return;
    said->second = now;
    if (entry.kind == fdds::Log::Kind::Error)
      log_error(text);
    else
      log_warning(text);
  }

 private:
  int invalidated_ = 0;
  std::map<std::string, std::chrono::steady_clock::time_point> said_;
};

}  // namespace

void own_process() {
  static const bool done = [] {
    fdds::Log::ClearConsumers();
    fdds::Log::RegisterConsumer(std::make_unique<LogBridge>());
    fdds::Log::SetVerbosity(fdds::Log::Kind::Warning);
    // One path for samples, whoever the other end is.
    eprosima::fastrtps::LibrarySettingsAttributes settings;
    settings.intraprocess_delivery = eprosima::fastrtps::INTRAPROCESS_OFF;
    eprosima::fastrtps::xmlparser::XMLProfileManager::library_settings(settings);
    return true;
  }();
  (void)done;
}

namespace {

template <class... Topics>
std::map<std::string, std::uint32_t> sample_bounds(std::tuple<Topics...>*) {
  constexpr std::size_t kEncoding = 4, kAlignment = 8;
  const auto largest = []<class Type>(Type* /*type*/) -> std::size_t {
    if constexpr (kInPlace<Type>) {
      Type sample;
      sample.reserve(Type::kMost);
      return InPlaceType<Type>::size_of(sample);
    } else {
      return Type::getMaxCdrSerializedSize() + kEncoding;
    }
  };
  return {
      {Topics::kName, std::uint32_t(largest(static_cast<Topics::Type*>(nullptr)) + kAlignment)}...};
}

/// What the guard may rely on. A profile sets what it likes: ports, servers, governance.
guard::Options guard_options(const Settings& settings) {
  static const auto bounds = sample_bounds(static_cast<AllTopics*>(nullptr));
  guard::Options options;
  const bool profile = !settings.profile_file.empty();
  if (!profile) options.domain = static_cast<int>(settings.domain);
  options.servers = profile || !settings.servers.empty();
  options.encrypted = !profile && all_is_encrypted(settings);
  options.largest_sample = [](const std::string& topic) {
    const auto found = bounds.find(topic);
    return found == bounds.end() ? 0U : found->second;
  };
  return options;
}

/// A check before every transport, one that knows what came through all of them. What a profile
/// leaves to Fast DDS (UDP and shared memory) is made here instead, so that it can be checked as
/// well. Error: Configuration for TCP: what breaks it are its own messages, which no check sees.
Result<void> guard_transports(fdds::DomainParticipantQos& qos, const Settings& settings,
                              const std::shared_ptr<GuardCounts>& counts) {
  using eprosima::fastdds::rtps::SharedMemTransportDescriptor;
  auto& transports = qos.transport().user_transports;
  if (std::exchange(qos.transport().use_builtin_transports, false)) {
    transports.push_back(std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>());
    transports.push_back(std::make_shared<SharedMemTransportDescriptor>());
  }
  const auto guard = std::make_shared<guard::Guard>(guard_options(settings));
  for (auto& transport : transports) {
    if (dynamic_cast<const eprosima::fastdds::rtps::TCPTransportDescriptor*>(transport.get()) !=
        nullptr)
      return Error{ErrorCode::kConfiguration, "dds.profile_file",
                   "has a TCP transport: Fast DDS 2.9 is ended by 18 bytes that it receives there",
                   "use UDP to peers, through a tunnel: deploy/network/README.md"};
    transport = guarded(transport, counts, guard);
  }
  return {};
}

Result<void> load_profile(const Settings& settings, fdds::DomainParticipantQos& qos) {
  auto* factory = fdds::DomainParticipantFactory::get_instance();
  const auto there = is_there(settings.profile_file);
  if (!there) return there.error();
  if (!*there)
    return Error{ErrorCode::kConfiguration, settings.profile_file, "no such DDS profile file",
                 "give dds.profile_file a path that exists"};
  if (factory->load_XML_profiles_file(settings.profile_file) !=
      eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK)
    return Error{ErrorCode::kConfiguration, settings.profile_file, "Fast DDS does not accept it",
                 "check it against the Fast DDS XML schema"};
  if (factory->get_participant_qos_from_profile(settings.profile_name, qos) !=
      eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK)
    return Error{ErrorCode::kConfiguration, settings.profile_file,
                 "has no participant profile named '" + settings.profile_name + "'",
                 "set dds.profile_name"};
  return {};
}

}  // namespace

void RefusalLog::onParticipantAuthentication(fdds::DomainParticipant* /*participant*/,
                                             rtps::ParticipantAuthenticationInfo&& info) {
  if (info.status == rtps::ParticipantAuthenticationInfo::AUTHORIZED_PARTICIPANT) return;
  std::ostringstream who;
  who << info.guid;
  log_warning("refused: participant " + who.str() +
              " is not authenticated (no certificate, or none of our CA)");
}

Participant::Participant(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Result<std::shared_ptr<Participant>> Participant::create(
    const Settings& settings, const std::string& name, fdds::DomainParticipantListener* listener) {
  if (settings.domain > 232)
    return Error{ErrorCode::kConfiguration, "dds.domain",
                 std::to_string(settings.domain) + " is outside 0..232", "choose a smaller domain"};
  if (!settings.guest) own_process();
  auto impl = std::make_unique<Impl>();
  impl->settings = settings;
  impl->zero_copy = zero_copy(settings);

  if (settings.uses_shared_memory()) {
    const auto removed = remove_stale_segments();
    if (removed > 0)
      log_info("removed " + std::to_string(removed) + " shared-memory files of dead processes");
    if (auto room = check_shared_memory(shared_memory_needed(settings)); !room) return room.error();
    auto port = claim_shm_port();
    if (!port) return port.error();
    impl->shm_port = std::move(*port);
  }
  fdds::DomainParticipantQos qos;
  if (!settings.profile_file.empty()) {
    if (auto loaded = load_profile(settings, qos); !loaded) return loaded.error();
  } else {
    if (auto set = set_network(qos, settings, impl->shm_port.number); !set) return set.error();
    auto expires = set_security(qos, settings);
    if (!expires) return expires.error();
    impl->certificate_expires = *expires;
    if (auto buffers = check_socket_buffers(settings.udp_buffer_kib << 10U); !buffers)
      log_warning(buffers.error().text());
  }
  if (auto ports = check_udp_ports(settings.domain); !ports) return ports.error();
  if (settings.guard_datagrams)
    if (auto guarded = guard_transports(qos, settings, impl->guard); !guarded)
      return guarded.error();
  qos.name(name);
  ++participants();

  auto* factory = fdds::DomainParticipantFactory::get_instance();
  impl->participant = factory->create_participant(settings.domain, qos,
                                                  listener != nullptr ? listener : &impl->refusals,
                                                  fdds::StatusMask::none());
  if (impl->participant == nullptr)
    return Error{ErrorCode::kResource, "DDS domain " + std::to_string(settings.domain),
                 "Fast DDS could not join: no such interface, no socket, or no shared memory",
                 "see its message above; check dds.interfaces against 'ip address', and 'ulimit'"};
  // It goes on without the port it cannot make, deaf to everybody on this host.
  if (settings.uses_shared_memory() && settings.profile_file.empty() &&
      !is_port_open(impl->shm_port.number)) {
    impl->participant->set_listener(nullptr);
    factory->delete_participant(impl->participant);
    return Error{ErrorCode::kResource, "/dev/shm",
                 "Fast DDS could not make its port there: no memory or no file descriptors left",
                 "enlarge the tmpfs (containers: --shm-size=1g), raise 'ulimit -n', or set "
                 "dds.shared_memory: false"};
  }
  std::copy_n(static_cast<const rtps::octet*>(impl->participant->guid().guidPrefix.value),
              impl->guard->self.size(), impl->guard->self.begin());
  impl->guard->has_self = true;
  std::ostringstream prefix;  // as Fast DDS writes it into the names of its segments
  prefix << impl->participant->guid().guidPrefix;
  if (settings.uses_shared_memory()) impl->segments = mark_segments(prefix.str());

  const std::string partition = "crane_" + std::to_string(settings.crane);
  fdds::PublisherQos publisher_qos;
  if (settings.partition) publisher_qos.partition().push_back(partition.c_str());
  impl->publisher = impl->participant->create_publisher(publisher_qos);
  fdds::SubscriberQos subscriber_qos;
  if (settings.partition) subscriber_qos.partition().push_back(partition.c_str());
  impl->subscriber = impl->participant->create_subscriber(subscriber_qos);
  if (impl->publisher == nullptr || impl->subscriber == nullptr)
    return Error{ErrorCode::kResource, "DDS", "no publisher or subscriber could be made", ""};
  return std::shared_ptr<Participant>(new Participant(std::move(impl)));
}

Participant::~Participant() {
  if (impl_->hosted) leave_host(*impl_, ended());
  if (impl_->hosted || impl_->participant == nullptr) return;
  impl_->participant->set_listener(nullptr);
  impl_->participant->delete_contained_entities();
  fdds::DomainParticipantFactory::get_instance()->delete_participant(impl_->participant);
}

TimeNs Participant::certificate_expires() const {
  return impl_->certificate_expires;
}

std::uint64_t Participant::refused_datagrams() const {
  return impl_->guard->refused;
}

std::vector<std::pair<std::string, std::uint64_t>> Participant::refusals() const {
  std::vector<std::pair<std::string, std::uint64_t>> out;
  const auto& counts = impl_->guard->by_refusal;
  for (std::size_t i = 0; i < counts.size(); ++i)
    if (const std::uint64_t n = counts[i]; n > 0)
      out.emplace_back(guard::text(static_cast<guard::Refusal>(i)), n);
  return out;
}

const Settings& Participant::settings() const {
  return impl_->settings;
}

}  // namespace crane::dds
