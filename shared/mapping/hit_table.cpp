#include "mapping/hit_table.hpp"

#include <algorithm>

namespace crane {

std::size_t HitTable::slot(std::int32_t x, std::int32_t y, std::int32_t z) const {
  std::uint64_t h = std::uint64_t(std::uint32_t(x)) * 0x9E3779B97F4A7C15ULL ^
                    std::uint64_t(std::uint32_t(y)) * 0xC2B2AE3D27D4EB4FULL ^
                    std::uint64_t(std::uint32_t(z)) * 0x165667B19E3779F9ULL;
  h ^= h >> 29U;
  const std::size_t mask = slots_.size() - 1;
  std::size_t i = h & mask;
  while (slots_[i].count > 0 && (slots_[i].x != x || slots_[i].y != y || slots_[i].z != z))
    i = (i + 1) & mask;
  return i;
}

void HitTable::clear() {
  std::fill(slots_.begin(), slots_.end(), Hit{});
  used_ = 0;
}

HitTable::Hit& HitTable::at(std::int32_t x, std::int32_t y, std::int32_t z) {
  if (2 * used_ >= slots_.size()) grow();
  Hit& hit = slots_[slot(x, y, z)];
  if (hit.count == 0) {
    hit.x = x;
    hit.y = y;
    hit.z = z;
    ++used_;
  }
  return hit;
}

std::uint32_t HitTable::count(std::int32_t x, std::int32_t y, std::int32_t z) const {
  return slots_[slot(x, y, z)].count;
}

void HitTable::grow() {
  std::vector<Hit> old(slots_.size() * 2);
  old.swap(slots_);
  for (const Hit& hit : old)
    if (hit.count > 0) slots_[slot(hit.x, hit.y, hit.z)] = hit;
}

}  // namespace crane
