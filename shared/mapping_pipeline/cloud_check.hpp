// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "base/drop_counts.hpp"
#include "mapping_pipeline/cloud_sample.hpp"

namespace crane {

/// What comes from outside becomes trusted here: sizes that fit each other, a camera model that can
/// be, a rotation that only turns, the calibration `calibration`. Depths that cannot be measured
/// (not finite, beyond what the baseline resolves) become "no match". Returns why the
/// cloud cannot be used, if so.
std::optional<Cause> check_cloud(CloudSample& cloud, std::uint64_t calibration);

}  // namespace crane
