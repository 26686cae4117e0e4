// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "mapper/map_publisher.hpp"

namespace crane {

/// What is to be said of the map: whether it may be relied on, and if not, why: what weighs most
/// comes first. `now`: of the clock that the pipeline is given.
MapPublisher::Health judge_validity(const PipelineReport& report, bool being_made,
                                    TimeNs stale_after, TimeNs now);

}  // namespace crane
