// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace crane {

/// Distribution of one stage's duration.
struct StageSummary {
  std::string name;
  std::uint64_t count = 0;
  double p50_ms = 0, p99_ms = 0, max_ms = 0;
};

/// Upper bounds of the buckets that are published [s]: the same for every stage and for ever, so
/// that those of several services and times can be added up.
inline constexpr std::array<double, 14> kStageBounds_s = {
    0.0001, 0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1, 2.5, 10};

/// How often one stage took at most each of the bounds.
struct StageHistogram {
  std::string name;
  std::array<std::uint64_t, kStageBounds_s.size()> at_most{};  ///< cumulative
  std::uint64_t count = 0;
  double sum_s = 0;
};

/// Durations per stage, bounded in memory: logarithmic buckets of 1 %, 1 us to 1000 s.
/// One thread. Percentiles are within 1 %, the maximum is exact.
class StageTimes {
 public:
  void add(const std::string& stage, double ms);
  [[nodiscard]] std::vector<StageSummary> summary() const;
  [[nodiscard]] std::vector<StageHistogram> histograms() const;

 private:
  struct Histogram {
    std::vector<std::uint32_t> buckets;
    std::array<std::uint64_t, kStageBounds_s.size()> within{};  ///< each its own, not cumulative
    std::uint64_t count = 0;
    double max_ms = 0, sum_ms = 0;
  };
  std::map<std::string, Histogram> stages_;
};

}  // namespace crane
