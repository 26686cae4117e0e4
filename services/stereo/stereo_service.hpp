// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace crane {

/// Service `cranemap-stereo`: stereo_frame in, partial_cloud out.
int run_stereo(int argc, char** argv);

}  // namespace crane
