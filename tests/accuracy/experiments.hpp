// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "cranemap/progress.hpp"
#include "document.hpp"
#include "trial.hpp"

namespace crane::accuracy {

/// Where an experiment writes, and how far the whole report is.
struct Bench {
  Document& document;
  Progress& progress;
  std::size_t done = 0, total = 0;
  void step(const std::string& what) { progress.update(done++, total, what); }
};

/// Zhao et al. 2021, sections 4.4 and 4.5, with `seeds` repetitions: Tables 3 and 4, times, file
/// sizes; and the same with cranemap's own method.
Result<void> paper_experiment(Bench& bench, int seeds);
std::size_t paper_experiment_steps(int seeds);

/// One property of scene, sensor or motion varied at a time.
Result<void> sweeps(Bench& bench);
std::size_t sweep_steps();

/// What one more frame costs in maps from 16 to 10,000 square metres.
Result<void> map_size(Bench& bench);
inline constexpr std::size_t kMapSizeSteps = 4;

/// What the watchdog makes of faults of calibration and rangefinders.
Result<void> watchdog_faults(Bench& bench);
inline constexpr std::size_t kWatchdogSteps = 12;

}  // namespace crane::accuracy
