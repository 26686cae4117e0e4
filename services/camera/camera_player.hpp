#pragma once

namespace crane {

/// Service `cranemap-camera`: plays the images of a recording as stereo_frame.
int run_camera(int argc, char** argv);

}  // namespace crane
