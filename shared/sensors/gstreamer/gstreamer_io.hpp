// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sensors/camera/pipeline_io.hpp"

/// What libcranemap-gstreamer.so is loaded for: pipelines by GStreamer. The caller owns it.
extern "C" crane::PipelineIo* cranemap_gstreamer_io();
