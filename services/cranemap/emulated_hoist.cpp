// SPDX-License-Identifier: Apache-2.0
#include "emulated_hoist.hpp"

#include <utility>

#include "dds/hoist_reading.hpp"
#include "service/client_options.hpp"
#include "service/run_service.hpp"
#include "sim/simulate.hpp"

namespace crane {

EmulatedHoist::EmulatedHoist(Scene scene, const SiteConfig& site, TimeNs start,
                             dds::Writer<dds::HoistStateTopic> writer)
    : scene_(std::move(scene)),
      crane_(static_cast<std::uint32_t>(site.crane)),
      start_(start),
      writer_(std::move(writer)) {}

Result<EmulatedHoist> EmulatedHoist::create(Scene scene, const SiteConfig& site, TimeNs start) {
  auto participant = dds::Participant::create(to_settings(site, "controller"), "emulated-hoist");
  if (!participant) return participant.error();
  auto writer = dds::Writer<dds::HoistStateTopic>::create(*participant);
  if (!writer) return writer.error();
  return EmulatedHoist(std::move(scene), site, start, std::move(*writer));
}

Result<void> EmulatedHoist::tell() {
  const TimeNs now = SystemClock().now();
  if (double(now - told_) * 1e-9 < 1 / scene_.hoist->rate_hz) return {};
  told_ = now;
  const HoistReading r = hoist_reading_at(scene_, double(now - start_) * 1e-9);
  v1::HoistState sample = dds::hoist_state(r);
  sample.crane(crane_);
  sample.sequence_number(++number_);
  sample.time_ns(now);
  return writer_.write(sample);
}

}  // namespace crane
