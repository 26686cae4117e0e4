// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "sensors/camera/genicam_io.hpp"
#include "sensors/camera/pipeline_io.hpp"

namespace crane {

/// What only some sites need is loaded when their configuration asks for it: its libraries take
/// memory and time at start. Looked for in ../lib/cranemap beside this program. Never unloaded.
/// Error: Resource when it, or a library it needs, is not installed.
Result<std::unique_ptr<GenicamIo>> load_genicam();
Result<std::unique_ptr<PipelineIo>> load_gstreamer();

}  // namespace crane
