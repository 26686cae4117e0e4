#pragma once

#include <cstdint>
#include <vector>

namespace crane {

/// Points of one frame gathered per voxel: open addressing, memory kept between frames.
class HitTable {
 public:
  struct Hit {
    std::int32_t x = 0, y = 0, z = 0;  ///< voxel
    std::uint32_t count = 0;           ///< points; 0 = empty slot
    float height_sum_m = 0;
    std::uint32_t r_sum = 0, g_sum = 0, b_sum = 0;
  };

  void clear();
  Hit& at(std::int32_t x, std::int32_t y, std::int32_t z);
  /// Points in a voxel; 0 = none.
  [[nodiscard]] std::uint32_t count(std::int32_t x, std::int32_t y, std::int32_t z) const;
  template <class F>
  void for_each(F&& f) const {
    for (const Hit& hit : slots_)
      if (hit.count > 0) f(hit);
  }
  [[nodiscard]] std::size_t size() const { return used_; }

 private:
  [[nodiscard]] std::size_t slot(std::int32_t x, std::int32_t y, std::int32_t z) const;
  void grow();
  std::vector<Hit> slots_ = std::vector<Hit>(1U << 15U);
  std::size_t used_ = 0;
};

}  // namespace crane
