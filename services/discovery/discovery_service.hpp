// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace crane {

/// The whole of cranemap-discovery.
int run_discovery(int argc, char** argv);

}  // namespace crane
