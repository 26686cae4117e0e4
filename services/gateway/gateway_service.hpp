// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace crane {

/// Service `cranemap-gateway`: page and API for who has no DDS.
int run_gateway(int argc, char** argv);

}  // namespace crane
