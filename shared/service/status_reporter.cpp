// SPDX-License-Identifier: Apache-2.0
#include "service/status_reporter.hpp"

#include <sys/resource.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>

#include "base/log.hpp"
#include "bounds.h"
#include "service/metrics.hpp"

namespace crane {
namespace {

double cpu_seconds() {
  rusage use{};
  getrusage(RUSAGE_SELF, &use);
  return double(use.ru_utime.tv_sec + use.ru_stime.tv_sec) +
         1e-6 * double(use.ru_utime.tv_usec + use.ru_stime.tv_usec);
}

std::uint64_t resident_bytes() {
  std::ifstream statm("/proc/self/statm");
  std::uint64_t total = 0;
  std::uint64_t resident = 0;
  statm >> total >> resident;
  return resident * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

}  // namespace

StatusReporter::StatusReporter(dds::Writer<dds::ServiceStatusTopic> writer,
                               std::shared_ptr<dds::Participant> participant, std::uint32_t service)
    : writer_(std::move(writer)),
      participant_(std::move(participant)),
      service_(service),
      start_ns_(SystemClock().now()),
      certificate_expires_(participant_->certificate_expires()),
      last_(std::chrono::steady_clock::now()),
      loop_(LoopWatch::of_process().watch("the service's loop", kLoopTurnsWithin)) {}

Result<StatusReporter> StatusReporter::create(const std::shared_ptr<dds::Participant>& participant,
                                              std::uint32_t service) {
  auto writer = dds::Writer<dds::ServiceStatusTopic>::create(participant);
  if (!writer) return writer.error();
  return StatusReporter(std::move(*writer), participant, service);
}

Result<void> StatusReporter::serve_http(const std::string& address, int port,
                                        const std::vector<std::string>& hosts) {
  auto started = HealthServer::start(address, port, hosts);
  if (!started) return started.error();
  health_ = std::move(*started);
  return {};
}

void StatusReporter::tick(bool now) {
  loop_.turned();
  if (!now && !due()) return;
  last_ = std::chrono::steady_clock::now();
  v1::ServiceStatus s;
  s.crane(participant_->settings().crane);
  s.service(service_);
  s.sequence_number(sequence_++);
  s.time_ns(SystemClock().now());
  s.start_ns(start_ns_);
  s.pid(static_cast<std::uint32_t>(getpid()));
  s.status(status);
  s.stream(stream);
  s.received(received);
  s.published(published);
  s.expected(expected);
  s.finished(finished ? 1 : 0);
  s.cpu_seconds(cpu_seconds());
  s.memory_bytes(resident_bytes());
  if (const std::uint64_t refused = participant_->refused_datagrams(); refused > 0)
    dropped.set(Cause::kMalformedDatagram, refused);
  if (health_) {
    dropped.set(Cause::kHttpRefused, health_->counts().refused);
    dropped.set(Cause::kHttpClosed, health_->counts().closed);
  }
  dropped.set(Cause::kLogLeftOut, log_lines_left_out());
  dropped.for_each([&s](Cause cause, std::uint64_t count) {
    if (s.dropped().size() == v1::MAX_CAUSES) return;
    v1::DropCount entry;
    entry.code(static_cast<std::uint32_t>(cause));
    entry.cause(std::string(cause_text(cause)).c_str());
    entry.count(count);
    s.dropped().push_back(entry);
  });
  for (const StageSummary& stage : stages.summary()) {
    if (s.stages().size() == v1::MAX_STAGES) break;
    v1::StageTime entry;
    entry.stage(stage.name.substr(0, 63).c_str());
    entry.count(stage.count);
    entry.p50_ms(stage.p50_ms);
    entry.p99_ms(stage.p99_ms);
    entry.max_ms(stage.max_ms);
    s.stages().push_back(entry);
  }
  for (const Measured& f : figures) {
    if (s.figures().size() == v1::MAX_FIGURES) break;
    v1::StatusFigure entry;
    entry.name(f.name.substr(0, 63).c_str());
    entry.value(f.value);
    entry.sigma(f.sigma);
    s.figures().push_back(entry);
  }
  s.version(CRANEMAP_VERSION);
  s.build_type(CRANEMAP_BUILD_TYPE);
  s.message(message.substr(0, 255).c_str());
  (void)writer_.write(s);  // a status that cannot be sent is repeated in a second

  static constexpr const char* kWords[] = {"ok", "degraded", "failed"};
  const std::string word = kWords[std::min<std::uint32_t>(status, v1::STATUS_FAILED)] +
                           (message.empty() ? "" : ": " + message);
  std::vector<Gauge> all = gauges;
  for (const auto& [name, value] : values)
    all.push_back({name, "See the service's README.", value, {}});
  for (const auto& [reason, count] : participant_->refusals())
    all.push_back({"datagrams_refused_total", "Datagrams that were refused, by reason.",
                   double(count), "reason=\"" + reason + "\"", true});
  if (certificate_expires_ > 0)
    all.push_back({"certificate_expires_time_seconds",
                   "When the certificate or its CA expires, Unix epoch.",
                   double(certificate_expires_) * 1e-9,
                   {}});
  if (health_)
    health_->tell({status != v1::STATUS_FAILED, status == v1::STATUS_OK, word,
                   to_metrics(s, stages.histograms(), all), s.crane(), service_});
  // Does nothing where systemd does not ask for it.
  const std::string hangs = LoopWatch::of_process().trouble();
  sd_notify(
      0,
      ("READY=1\n" + (hangs.empty() ? "WATCHDOG=1\nSTATUS=" + word : "STATUS=" + hangs)).c_str());
}

void StatusReporter::flush(std::chrono::milliseconds limit) {
  tick(true);
  (void)writer_.wait_for_readers(limit);
}

}  // namespace crane
