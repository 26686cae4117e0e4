// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gst/gst.h>

#include "base/result.hpp"

namespace crane {

/// What a pipeline's error message says: which element, what happened, what to do about it.
Error pipeline_error(GstMessage* message);
/// Of a text that is no pipeline. Configuration.
Error parse_error(const GError* error);

}  // namespace crane
