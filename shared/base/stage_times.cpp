#include "base/stage_times.hpp"

#include <algorithm>
#include <cmath>

namespace crane {
namespace {

constexpr double kFirstMs = 1e-3;
constexpr double kStep = 1.01;
constexpr std::size_t kBuckets = 2084;  // 1 us * 1.01^2083 = 1000 s

std::size_t bucket_of(double ms) {
  if (!(ms > kFirstMs)) return 0;
  const auto index = static_cast<std::size_t>(std::log(ms / kFirstMs) / std::log(kStep)) + 1;
  return std::min(index, kBuckets - 1);
}

double upper_ms(std::size_t bucket) {
  return kFirstMs * std::pow(kStep, double(bucket));
}

}  // namespace

void StageTimes::add(const std::string& stage, double ms) {
  Histogram& h = stages_[stage];
  if (h.buckets.empty()) h.buckets.resize(kBuckets);
  ++h.buckets[bucket_of(ms)];
  ++h.count;
  h.max_ms = std::max(h.max_ms, ms);
}

std::vector<StageSummary> StageTimes::summary() const {
  std::vector<StageSummary> out;
  for (const auto& stage : stages_) {
    const Histogram& h = stage.second;
    const auto percentile = [&h](double p) {
      const double wanted = p * double(h.count);
      double seen = 0;
      for (std::size_t i = 0; i < kBuckets; ++i) {
        seen += h.buckets[i];
        if (seen >= wanted && seen > 0) return std::min(upper_ms(i), h.max_ms);
      }
      return h.max_ms;
    };
    out.push_back({stage.first, h.count, percentile(0.50), percentile(0.99), h.max_ms});
  }
  return out;
}

}  // namespace crane
