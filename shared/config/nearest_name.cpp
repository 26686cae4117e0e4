// SPDX-License-Identifier: Apache-2.0
#include "config/nearest_name.hpp"

#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

namespace crane {
namespace {

constexpr std::size_t kLongest = 64, kSameBeginning = 5;

std::size_t edits(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);  // from the beginning of a to each beginning of b
  std::iota(row.begin(), row.end(), 0U);
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i + 1);
    for (std::size_t k = 0; k < b.size(); ++k) {
      const std::size_t changed = diagonal + (a[i] == b[k] ? 0 : 1);
      diagonal = row[k + 1];
      row[k + 1] = std::min({changed, row[k] + 1, row[k + 1] + 1});
    }
  }
  return row.back();
}

bool is_near(const std::string& a, const std::string& b, std::size_t distance) {
  if (distance <= std::max<std::size_t>(1, a.size() / 3)) return true;
  const auto end = std::mismatch(a.begin(), a.end(), b.begin(), b.end()).first;
  return end - a.begin() >= std::ptrdiff_t(kSameBeginning);
}

}  // namespace

std::string nearest_name(const std::string& name, const std::set<std::string>& names) {
  if (name.size() > kLongest) return "";  // from a hostile file
  std::string nearest;
  std::size_t least = kLongest;
  for (const std::string& candidate : names) {
    const std::size_t distance = edits(name, candidate);
    if (distance >= least || !is_near(name, candidate, distance)) continue;
    least = distance;
    nearest = candidate;
  }
  return nearest;
}

}  // namespace crane
