// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "base/clock.hpp"
#include "base/result.hpp"
#include "dds/settings.hpp"

namespace eprosima::fastdds::dds {
class DomainParticipant;
class DomainParticipantListener;
}  // namespace eprosima::fastdds::dds

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
  /// Room for readers and writers of a crane within a participant that is there already, in this
  /// process. Nothing of it is changed: what is made within it goes with what is returned, its
  /// listeners hear nothing of it, and it is guarded as far as whoever made it took care of that.
  /// It has to outlive what is returned: ended() says when it did not.
  /// Error: Configuration when it is not enabled, Resource.
  static Result<std::shared_ptr<Participant>> within(
      eprosima::fastdds::dds::DomainParticipant& host, std::uint32_t crane);
  ~Participant();
  Participant(const Participant&) = delete;
  Participant& operator=(const Participant&) = delete;

  [[nodiscard]] const Settings& settings() const;
  /// When the certificate expires that we joined with; 0 without DDS Security.
  [[nodiscard]] TimeNs certificate_expires() const;
  /// Datagrams that were refused before Fast DDS saw them.
  [[nodiscard]] std::uint64_t refused_datagrams() const;
  /// ... and why: reasons that there were, in words, and how often.
  [[nodiscard]] std::vector<std::pair<std::string, std::uint64_t>> refusals() const;

  /// Of one made by within(): the host, or what was made in it, was deleted before this was. No
  /// reader or writer may be used any more; they may be destroyed.
  [[nodiscard]] bool ended() const;
  /// For within().
  [[nodiscard]] eprosima::fastdds::dds::DomainParticipant& fast_dds() const;

  struct Impl;
  [[nodiscard]] Impl& impl() const { return *impl_; }

 private:
  explicit Participant(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace crane::dds
