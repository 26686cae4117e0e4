// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace crane {

/// Service `cranemap-rangefinder`: plays cart and trolley of a recording as rangefinder_position.
int run_rangefinder(int argc, char** argv);

}  // namespace crane
