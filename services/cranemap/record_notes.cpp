// SPDX-License-Identifier: Apache-2.0
#include "record_notes.hpp"

#include <cstdio>
#include <sstream>

#include "config/yaml_text.hpp"
#include "record_units.hpp"
#include "recording/time_check.hpp"

namespace crane {

std::uint64_t lost_frames(const DropCounts& dropped) {
  std::uint64_t lost = 0;
  for (const Cause cause : {Cause::kFrameInvalid, Cause::kFrameLost, Cause::kFrameMissing,
                            Cause::kFrameOverwritten, Cause::kRecordTooSlow, Cause::kRecordNoRoom})
    lost += dropped.of(cause);
  return lost;
}

Result<void> write_site_files(const SiteConfig& site, const RecordingSink& sink) {
  SiteConfig played;
  played.stereo = site.stereo;
  played.mapper = site.mapper;
  played.hoist = site.hoist;
  played.watchdog = site.watchdog;
  played.zones = site.zones;
  if (auto written = sink.write_text("site.yaml", to_yaml(played)); !written) return written;
  return sink.write_text("recorded_with.yaml", to_yaml(site));
}

Result<void> write_notes(const RecordNotes& n, const RecordingSink& sink) {
  std::ostringstream s;
  s << "# written by cranemap record\ncranemap: " << CRANEMAP_VERSION << "\ncrane: " << n.crane
    << "\nbegan_utc: \"" << utc_text(n.began) << "\"\nended_utc: \"" << utc_text(n.ended)
    << "\"\nframes: " << n.frames << "\nimage_bytes: " << n.bytes
    << "\nended: " << yaml_quoted(n.why_ended) << "\nnot_recorded:";
  bool any = false;
  n.dropped.for_each([&](Cause cause, std::uint64_t count) {
    any = true;
    s << "\n  - {cause: \"" << cause_text(cause) << "\", count: " << count << "}";
  });
  s << (any ? "\n" : " []\n");
  return sink.write_text("record.yaml", s.str());
}

void print(const RecordNotes& n, const std::string& folder) {
  std::printf("%zu frames, %s, from %s to %s UTC\n", n.frames, size_text(n.bytes).c_str(),
              utc_text(n.began).c_str(), utc_text(n.ended).c_str());
  n.dropped.for_each([](Cause cause, std::uint64_t count) {
    std::printf("not recorded  %llu x %s\n", static_cast<unsigned long long>(count),
                std::string(cause_text(cause)).c_str());
  });
  std::printf("play it:  cranemap run %s --out OUT\n", folder.c_str());
}

}  // namespace crane
