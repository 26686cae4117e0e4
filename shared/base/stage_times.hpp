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
  /// Takes over the stages of `other`, which has other names.
  void merge(const StageTimes& other) {
    stages_.insert(other.stages_.begin(), other.stages_.end());
  }

 private:
  struct Histogram {
    std::vector<std::uint32_t> buckets;
    std::uint64_t count = 0;
    double max_ms = 0;
  };
  std::map<std::string, Histogram> stages_;
};

/// Named counts of what was not used, and why. One thread.
class DropCounts {
 public:
  void add(const std::string& cause, std::uint64_t by = 1) { counts_[cause] += by; }
  void set(const std::string& cause, std::uint64_t value) {
    if (value > 0) counts_[cause] = value;
  }
  [[nodiscard]] const std::map<std::string, std::uint64_t>& counts() const { return counts_; }

 private:
  std::map<std::string, std::uint64_t> counts_;
};

}  // namespace crane
