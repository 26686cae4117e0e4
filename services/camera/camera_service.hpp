// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace crane {

/// Service `cranemap-camera`: pairs of images of whatever source, as stereo_frame.
int run_camera(int argc, char** argv);

}  // namespace crane
