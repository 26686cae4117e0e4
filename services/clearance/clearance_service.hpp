// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace crane {

/// Service `cranemap-clearance`: answers clearance_request for controllers without our library.
int run_clearance(int argc, char** argv);

}  // namespace crane
