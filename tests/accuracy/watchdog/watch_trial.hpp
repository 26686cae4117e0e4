// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "mapping_pipeline/mapping_pipeline.hpp"
#include "recording/recording.hpp"
#include "sim/faults.hpp"

namespace crane::accuracy {

/// What the watchdog made of one recording.
struct WatchOutcome {
  WatchState state = WatchState::kFine;       ///< at the end
  Misfit misfit;                              ///< likewise
  int drifting_after = -1, wrong_after = -1;  ///< frame, from 0; -1 = never
  double wrong_after_s = -1;                  ///< since the first frame
  std::size_t frames = 0, used = 0;
  double watch_ms = 0;  ///< mean of a frame
};

/// Frames of a recording, matched and mapped in this process with a calibration and readings that
/// `faults` spoil. The images are as they are: one rendering serves many faults.
/// Where the cart has two rangefinders and `skew` is set, its rails are as the recording's
/// site.yaml says. `tell`: after each frame. `config`: what readings mean.
Result<WatchOutcome> watch(
    const Recording& recording, const std::vector<Fault>& faults,
    const std::function<void(std::size_t, const MappingPipeline&)>& tell = {}, bool skew = true,
    MapperConfig config = {});

}  // namespace crane::accuracy
