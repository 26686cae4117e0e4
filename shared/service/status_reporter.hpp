// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "base/drop_counts.hpp"
#include "base/loop_watch.hpp"
#include "base/stage_times.hpp"
#include "dds/endpoints.hpp"
#include "service/health.hpp"
#include "service/metrics.hpp"

namespace crane {

/// Two stages of a sample that was just taken: `name`, from write() until Fast DDS told its reader,
/// and "taken after", from then until the service's thread had it (its queue included).
template <class Type>
void add_delivery_times(StageTimes& stages, const std::string& name,
                        const dds::Received<Type>& sample, const dds::ReaderCounts& counts) {
  const TimeNs told = std::max(counts.told_ns, sample.source_time_ns());
  stages.add(name, double(told - sample.source_time_ns()) * 1e-6);
  stages.add("taken after", double(SystemClock().now() - told) * 1e-6);
}

/// What a reader did not hand on.
inline void add_reader_drops(DropCounts& dropped, Cause invalid, Cause lost,
                             const dds::ReaderCounts& counts) {
  dropped.set(invalid, counts.invalid);
  dropped.set(lost, counts.lost);
}

/// What one service tells the world once a second: counts, causes of drops, stage times; by topic
/// service_status, over HTTP, and to systemd, whose watchdog it feeds while all threads turn.
/// Its own calls are the service's loop turning. One thread.
class StatusReporter {
 public:
  /// `service`: v1::SERVICE_*.
  static Result<StatusReporter> create(const std::shared_ptr<dds::Participant>& participant,
                                       std::uint32_t service);
  /// So long a piece of work may take: a large map from disk, the paper's filters.
  static constexpr std::chrono::seconds kLoopTurnsWithin{20};

  /// From now on over HTTP as well. Error: Resource when the port cannot be had.
  Result<void> serve_http(const std::string& address, int port,
                          const std::vector<std::string>& hosts);

  StageTimes stages;
  DropCounts dropped;
  std::uint64_t received = 0, published = 0, expected = 0, stream = 0;
  bool finished = false;
  std::uint32_t status = 0;  ///< v1::STATUS_*
  std::string message;
  struct Measured {
    std::string name;
    double value, sigma;
  };
  std::vector<Measured> figures;         ///< what the service measures, with standard deviations
  std::vector<Gauge> gauges;             ///< for /metrics
  std::map<std::string, double> values;  ///< gauges as well, of names known at run time

  /// Speaks from now on for another of v1::SERVICE_*.
  void serve_as(std::uint32_t service) { service_ = service; }

  /// Whether tick() would publish: what is dear to collect is collected only then.
  [[nodiscard]] bool due() const {
    return std::chrono::steady_clock::now() - last_ >= std::chrono::seconds(1);
  }
  /// Publishes when a second has passed, or at once when `now` is set.
  void tick(bool now = false);
  /// Publishes and waits up to `limit` until readers have it.
  void flush(std::chrono::milliseconds limit);

 private:
  StatusReporter(dds::Writer<dds::ServiceStatusTopic> writer,
                 std::shared_ptr<dds::Participant> participant, std::uint32_t service);
  dds::Writer<dds::ServiceStatusTopic> writer_;
  std::shared_ptr<dds::Participant> participant_;
  std::unique_ptr<HealthServer> health_;
  std::uint32_t service_;
  std::uint64_t sequence_ = 0;
  TimeNs start_ns_, certificate_expires_;
  std::chrono::steady_clock::time_point last_;
  LoopWatch::Mark loop_;  ///< of the service, which calls tick()
};

}  // namespace crane
