// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gst/gst.h>

#include <optional>
#include <string>

#include "base/clock.hpp"

namespace crane {

/// When a picture was taken, Unix epoch [ns], and what says so.
struct CaptureTime {
  TimeNs epoch = 0;
  const char* clock = "";
};

/// Whether its own clock tells when pictures were taken: what feeds `sink` is live, and they came
/// over no network, for then they are stamped when they arrive. Asked once it plays.
bool stamps_captures(GstElement* pipeline, GstElement* sink);

/// Of its reference timestamp (NTP, PTP, Unix; from RTCP sender reports or RFC 7273), else, where
/// `live`, of the pipeline's clock. Nothing: it is not said.
std::optional<CaptureTime> capture_time(GstSample* sample, GstElement* pipeline, bool live);

}  // namespace crane
