// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "base/clock.hpp"
#include "base/drop_counts.hpp"
#include "config/site_config.hpp"
#include "recording/recording_sink.hpp"

namespace crane {

/// What is to be known of a recording besides its samples; record.yaml.
struct RecordNotes {
  int crane = 0;
  TimeNs began = 0, ended = 0;
  std::size_t frames = 0;
  std::uint64_t bytes = 0;
  std::string why_ended;
  DropCounts dropped;
};

/// Of what was to be recorded: frames that did not get there.
std::uint64_t lost_frames(const DropCounts& dropped);

/// site.yaml, which 'cranemap run' takes: mapper, stereo, hoist and zones, but no network and no
/// devices, so that a play never meets the crane it was recorded from. recorded_with.yaml: all.
/// Error: Resource.
Result<void> write_site_files(const SiteConfig& site, const RecordingSink& sink);
Result<void> write_notes(const RecordNotes& notes, const RecordingSink& sink);
/// The same for people, on stdout.
void print(const RecordNotes& notes, const std::string& folder);

}  // namespace crane
