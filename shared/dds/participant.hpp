#pragma once

#include <memory>
#include <string>

#include "base/clock.hpp"
#include "base/result.hpp"
#include "dds/settings.hpp"

namespace eprosima::fastdds::dds {
class DomainParticipantListener;
}

namespace crane::dds {

/// The process is ours: what Fast DDS logs goes where our log goes, and its library settings are
/// the ones that our topics need. Every participant but a guest does it; call it where there are
/// guests only.
void own_process();

/// One process on the DDS network. Outlives its readers and writers.
class Participant {
 public:
  /// Clears what dead processes left in shared memory, checks what the transport needs, joins.
  /// Error: Configuration (settings, profile file) or Resource (/dev/shm, buffers, ports),
  /// with what to do.
  /// `listener`: told of all participants, readers and writers instead of the log; of
  /// NetworkObserver.
  static Result<std::shared_ptr<Participant>> create(
      const Settings& settings, const std::string& name,
      eprosima::fastdds::dds::DomainParticipantListener* listener = nullptr);
  ~Participant();
  Participant(const Participant&) = delete;
  Participant& operator=(const Participant&) = delete;

  [[nodiscard]] const Settings& settings() const;
  /// When the certificate expires that we joined with; 0 without DDS Security.
  [[nodiscard]] TimeNs certificate_expires() const;
  /// Datagrams that were refused before Fast DDS saw them.
  [[nodiscard]] std::uint64_t refused_datagrams() const;

  struct Impl;
  [[nodiscard]] Impl& impl() const { return *impl_; }

 private:
  explicit Participant(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace crane::dds
