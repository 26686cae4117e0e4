// SPDX-License-Identifier: Apache-2.0
#include "sensors/gstreamer/capture_time.hpp"

#include <gst/base/gstbasesink.h>

#include <cstring>

namespace crane {
namespace {

/// From 1900, where NTP begins, to 1970.
constexpr TimeNs kNtpAhead = 2'208'988'800 * kNsPerSecond;
/// TAI, which PTP tells, is ahead of UTC by so much since 2017.
constexpr TimeNs kTaiAhead = 37 * kNsPerSecond;

struct Reference {
  const char* caps;
  TimeNs ahead;
  const char* clock;
};
constexpr Reference kReferences[] = {
    {"timestamp/x-unix", 0, "the reference time in its stream"},
    {"timestamp/x-ntp", kNtpAhead, "the camera's NTP time (RTCP sender reports)"},
    {"timestamp/x-ptp", kTaiAhead, "PTP"},
};

bool of_the_network(const GValue* item) {
  auto* element = static_cast<GstElement*>(g_value_get_object(item));
  const char* kind = gst_element_get_metadata(element, GST_ELEMENT_METADATA_KLASS);
  return kind != nullptr && std::strstr(kind, "Network") != nullptr;
}

}  // namespace

bool stamps_captures(GstElement* pipeline, GstElement* sink) {
  // Of what is before the sink: the sink itself calls itself live as soon as it keeps time.
  gboolean live = FALSE;
  if (gst_base_sink_query_latency(GST_BASE_SINK(sink), nullptr, &live, nullptr, nullptr) == 0 ||
      live == FALSE)
    return false;
  bool network = false;
  GstIterator* all = gst_bin_iterate_recurse(GST_BIN(pipeline));
  while (gst_iterator_foreach(
             all,
             +[](const GValue* item, void* found) {
               if (of_the_network(item)) *static_cast<bool*>(found) = true;
             },
             &network) == GST_ITERATOR_RESYNC)
    gst_iterator_resync(all);
  gst_iterator_free(all);
  return !network;
}

std::optional<CaptureTime> capture_time(GstSample* sample, GstElement* pipeline, bool live) {
  GstBuffer* buffer = gst_sample_get_buffer(sample);
  for (const Reference& reference : kReferences) {
    GstCaps* caps = gst_caps_new_empty_simple(reference.caps);
    const GstReferenceTimestampMeta* meta = gst_buffer_get_reference_timestamp_meta(buffer, caps);
    gst_caps_unref(caps);
    if (meta == nullptr || !GST_CLOCK_TIME_IS_VALID(meta->timestamp)) continue;
    const TimeNs epoch = static_cast<TimeNs>(meta->timestamp) - reference.ahead;
    if (epoch > 0) return CaptureTime{epoch, reference.clock};
  }
  if (!live || !GST_BUFFER_PTS_IS_VALID(buffer)) return std::nullopt;
  const GstClockTime running = gst_segment_to_running_time(gst_sample_get_segment(sample),
                                                           GST_FORMAT_TIME, GST_BUFFER_PTS(buffer));
  GstClock* clock = gst_element_get_clock(pipeline);
  if (clock == nullptr) return std::nullopt;
  const GstClockTime now = gst_clock_get_time(clock);
  gst_object_unref(clock);
  if (!GST_CLOCK_TIME_IS_VALID(running)) return std::nullopt;
  const auto taken = static_cast<TimeNs>(gst_element_get_base_time(pipeline) + running);
  return CaptureTime{SystemClock().now() - (static_cast<TimeNs>(now) - taken),
                     "the pipeline's clock, which its live source stamps by"};
}

}  // namespace crane
