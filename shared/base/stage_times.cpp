// SPDX-License-Identifier: Apache-2.0
#include "base/stage_times.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

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
  if (ms > 0) h.sum_ms += ms;  // clocks of two hosts may disagree; a sum must not fall
  const auto* bound = std::lower_bound(kStageBounds_s.begin(), kStageBounds_s.end(), ms * 1e-3);
  if (bound != kStageBounds_s.end())
    ++h.within[static_cast<std::size_t>(bound - kStageBounds_s.begin())];
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

std::vector<StageHistogram> StageTimes::histograms() const {
  std::vector<StageHistogram> out;
  for (const auto& [name, h] : stages_) {
    StageHistogram of{name, h.within, h.count, h.sum_ms * 1e-3};
    std::partial_sum(of.at_most.begin(), of.at_most.end(), of.at_most.begin());
    out.push_back(std::move(of));
  }
  return out;
}

}  // namespace crane
