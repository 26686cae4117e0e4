#pragma once

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

/// Durations per stage, bounded in memory: logarithmic buckets of 1 %, 1 us to 1000 s.
/// One thread. Percentiles are within 1 %, the maximum is exact.
class StageTimes {
 public:
  void add(const std::string& stage, double ms);
  [[nodiscard]] std::vector<StageSummary> summary() const;

 private:
  struct Histogram {
    std::vector<std::uint32_t> buckets;
    std::uint64_t count = 0;
    double max_ms = 0;
  };
  std::map<std::string, Histogram> stages_;
};

}  // namespace crane
