// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <string>

#include "base/clock.hpp"
#include "base/result.hpp"
#include "base/wakeup.hpp"
#include "dds/participant.hpp"
#include "dds/topics.hpp"

namespace crane::dds {

/// The key fields of an instance as DDS puts them on the network: big-endian, aligned, zeros
/// behind.
using InstanceKey = std::array<std::uint8_t, 16>;

/// The process on the network that a sample came from: the same for all of its writers, and chosen
/// by no sample. Nobody has all zeros.
using ParticipantId = std::array<std::uint8_t, 12>;

/// A received, validated sample, possibly still in the writer's memory. Given back when destroyed.
/// Use it at once and give it back within 100 ms: that long a writer waits before it ends.
template <class Type>
class Received {
 public:
  struct State;
  explicit Received(std::unique_ptr<State> state);
  ~Received();
  Received(Received&&) noexcept;
  Received& operator=(Received&&) noexcept;

  /// Of topics whose QosSpec says so: the instance key() has ended, and there is no sample.
  [[nodiscard]] bool disposed() const;
  [[nodiscard]] InstanceKey key() const;
  [[nodiscard]] ParticipantId writer() const;
  const Type& operator*() const;
  const Type* operator->() const { return &**this; }
  /// False when the writer has meanwhile written over a zero-copy sample. Ask *after* use, and
  /// throw away what was made of it.
  [[nodiscard]] bool intact() const;
  /// When write() was called, system clock of the writer.
  [[nodiscard]] TimeNs source_time_ns() const;

 private:
  std::unique_ptr<State> state_;
};

/// Counts since the reader was made.
struct ReaderCounts {
  std::uint64_t received = 0;  ///< samples handed out
  std::uint64_t invalid = 0;   ///< samples refused by validation
  std::uint64_t lost = 0;      ///< told lost or rejected by Fast DDS
  int matched = 0;             ///< writers now
  TimeNs told_ns = 0;          ///< when Fast DDS last said that there is a sample
};

/// Typed reader. take() from one thread; DDS callbacks only notify `wakeup`.
template <class Topic>
class Reader {
 public:
  using Type = typename Topic::Type;
  struct Impl;

  static Result<Reader> create(const std::shared_ptr<Participant>& participant, Wakeup* wakeup);
  ~Reader();
  Reader(Reader&&) noexcept;

  /// Next sample in order of arrival, or nothing. Samples that break their contract are counted,
  /// logged and skipped.
  std::unique_ptr<Received<Type>> take();
  [[nodiscard]] ReaderCounts counts() const;
  /// The processes with a writer that is matched now, and since when [monotonic]. One that was
  /// killed is among them until its lease ends.
  [[nodiscard]] std::map<ParticipantId, TimeNs> writers() const;

 private:
  explicit Reader(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Typed writer. One thread.
template <class Topic>
class Writer {
 public:
  using Type = typename Topic::Type;
  struct Impl;

  /// `name`: of the topic, where it depends on the crane. `strength`: of exclusive topics.
  /// `capacity`: of topics with zero-copy, what is lent (Type::reserve()); 0: nothing is, and
  /// samples are written by copy. Error: Resource, e.g. too little shared memory for it.
  static Result<Writer> create(const std::shared_ptr<Participant>& participant,
                               const std::string& name = Topic::kName, int strength = 0,
                               std::size_t capacity = 0);
  ~Writer();
  Writer(Writer&&) noexcept;

  /// Copies the sample into the history. Error: Resource when Fast DDS refuses it.
  Result<void> write(const Type& sample);
  /// Ends the instance that the sample's key fields name. Error: Resource.
  Result<void> dispose(const Type& sample);
  /// Memory of the history to fill in place, its images as large as the capacity; nullptr while all
  /// of it is lent out. Images that are smaller are shrunk, and then copied. For topics with
  /// zero-copy. Hand it to publish() or discard().
  Type* loan();
  Result<void> publish(Type* loaned);
  void discard(Type* loaned);
  /// Waits until every matched reader has all; false on time-out.
  bool wait_for_readers(std::chrono::milliseconds limit);
  [[nodiscard]] int matched() const;

 private:
  explicit Writer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace crane::dds
