// SPDX-License-Identifier: Apache-2.0
// No Eigen, OpenCV or standard containers here: what this file compiles with wide instructions must
// not be merged by the linker into code for every processor.
#include "stereo/semi_global_sweep.hpp"

#include "base/simd_targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "stereo/semi_global_sweep.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace crane::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Bytes; at most 32 lanes, so that 32 disparities are whole vectors everywhere.
using U8 = hn::CappedTag<std::uint8_t, 32>;
using Bytes = hn::Vec<U8>;
constexpr std::int8_t kCensusNoise = 1;  ///< grey levels that make no difference
constexpr int kHalfScale = 16;           ///< half a pixel in units of the disparity
constexpr int kLanes = static_cast<int>(hn::MaxLanes(U8()));

HWY_INLINE Bytes set(int value) {
  return hn::Set(U8(), static_cast<std::uint8_t>(value));
}

#if HWY_TARGET == HWY_AVX2
/// The upper half of `before` and the lower half of `v`, and so on: what a shift by one lane needs,
/// as the shifts of this target work on halves.
HWY_INLINE Bytes middle(Bytes v, Bytes before) {
  return hn::ConcatLowerUpper(U8(), v, before);
}
#else
HWY_INLINE Bytes middle(Bytes /*v*/, Bytes before) {
  return before;
}
#endif

/// Lane i of the result is lane i - 1 of `v`; lane 0 the last one of `before`.
HWY_INLINE Bytes slide_up(Bytes v, Bytes before) {
  return hn::CombineShiftRightBytes<15>(U8(), v, middle(v, before));
}

/// Lane i of the result is lane i + 1 of `v`; the last one lane 0 of `after`.
HWY_INLINE Bytes slide_down(Bytes v, Bytes after) {
#if HWY_TARGET == HWY_AVX2
  after = middle(after, v);
#endif
  return hn::CombineShiftRightBytes<1>(U8(), after, v);
}

/// The least byte of `v` in every lane.
HWY_INLINE Bytes min_everywhere(Bytes v) {
  const hn::FixedTag<std::uint8_t, 16> d8;
  const hn::FixedTag<std::uint16_t, 8> d16;
#if HWY_TARGET == HWY_AVX2
  auto low = hn::Min(hn::LowerHalf(d8, v), hn::UpperHalf(d8, v));
#else
  auto low = v;
#endif
  low = hn::Min(low, hn::BitCast(d8, hn::ShiftRight<8>(hn::BitCast(d16, low))));  // odd bytes 0
#if HWY_TARGET == HWY_AVX2
  return Bytes{_mm256_broadcastb_epi8(_mm_minpos_epu16(low.raw))};
#else
  const auto least = hn::MinOfLanes(d16, hn::BitCast(d16, low));
  return hn::TableLookupBytes(hn::BitCast(d8, least), hn::Zero(d8));
#endif
}

void CensusRow(const std::int8_t* padded, std::ptrdiff_t stride, int width, bool mirrored,
               std::uint8_t* const planes[kCensusPlanes]) {
  const hn::RebindToSigned<U8> di;
  for (int x = 0; x < width; x += kLanes) {
    Bytes plane[kCensusPlanes];
    for (Bytes& p : plane) p = hn::Zero(U8());
    int bit = 0;
    for (int dy = 0; dy <= kCensusReachY; ++dy)
      for (int dx = dy == 0 ? 1 : -kCensusReachX; dx <= kCensusReachX; ++dx, ++bit) {
        const std::ptrdiff_t opposite = dy * stride + (mirrored ? -dx : dx);
        const auto a = hn::LoadU(di, padded + x + opposite);
        const auto b = hn::LoadU(di, padded + x - opposite);
        const Bytes brighter = hn::BitCast(
            U8(), hn::VecFromMask(di, hn::Gt(a, hn::SaturatedAdd(b, hn::Set(di, kCensusNoise)))));
        plane[bit / 4] = hn::Or(plane[bit / 4], hn::And(brighter, set(1 << (bit % 4))));
      }
    for (int p = 0; p < kCensusPlanes; ++p) hn::StoreU(plane[p], U8(), planes[p] + x);
  }
}

/// Costs of one path at one pixel, all disparities, less the least of them.
template <int V>
struct Path {
  Bytes cost[V];

  HWY_INLINE void clear() {
    for (int v = 0; v < V; ++v) cost[v] = hn::Zero(U8());
  }
  /// L(p, d) = C(p, d) + min(L(q, d), L(q, d +- 1) + P1, P2) - min L(p), in place.
  HWY_INLINE void step(const Bytes (&pixel)[V], Bytes p1, Bytes p2) {
    const Bytes wall = set(255);
    Bytes next[V];
    for (int v = 0; v < V; ++v) {
      const Bytes up = slide_up(cost[v], v > 0 ? cost[v > 0 ? v - 1 : 0] : wall);
      const Bytes down = slide_down(cost[v], v + 1 < V ? cost[v + 1 < V ? v + 1 : 0] : wall);
      const Bytes bent = hn::SaturatedAdd(hn::Min(up, down), p1);
      next[v] = hn::Add(pixel[v], hn::Min(hn::Min(cost[v], p2), bent));
    }
    Bytes low = next[0];
    for (int v = 1; v < V; ++v) low = hn::Min(low, next[v]);
    const Bytes least = min_everywhere(low);
    for (int v = 0; v < V; ++v) cost[v] = hn::Sub(next[v], least);
  }
};

/// For every pixel of the right image the left pixel that fits it best, while the left pixel moves
/// along the row: lane d belongs to right pixel x - first - d.
template <int V, int kDirection>
struct RightWinners {
  Bytes cost[V], disparity[V];

  HWY_INLINE void clear() {
    for (int v = 0; v < V; ++v) cost[v] = set(255), disparity[v] = hn::Zero(U8());
  }
  /// To the next left pixel. The right pixel that leaves the window is stored, together with
  /// lanes that later stores write over; `mirrored` is where left pixel x - first would be.
  HWY_INLINE void advance(std::uint8_t* mirrored) {
    const Bytes wall = set(255);
    if constexpr (kDirection > 0) {
      hn::StoreU(disparity[V - 1], U8(), mirrored + (V - 1) * kLanes);
      for (int v = V - 1; v >= 0; --v) {
        cost[v] = slide_up(cost[v], v > 0 ? cost[v > 0 ? v - 1 : 0] : wall);
        disparity[v] = slide_up(disparity[v], v > 0 ? disparity[v > 0 ? v - 1 : 0] : wall);
      }
    } else {
      hn::StoreU(disparity[0], U8(), mirrored);
      for (int v = 0; v < V; ++v) {
        cost[v] = slide_down(cost[v], v + 1 < V ? cost[v + 1 < V ? v + 1 : 0] : wall);
        disparity[v] =
            slide_down(disparity[v], v + 1 < V ? disparity[v + 1 < V ? v + 1 : 0] : wall);
      }
    }
  }
  HWY_INLINE void offer(const Bytes (&sum)[V], const Bytes (&index)[V]) {
    for (int v = 0; v < V; ++v) {
      const auto no_better = hn::Eq(hn::Max(cost[v], sum[v]), sum[v]);
      disparity[v] = hn::IfThenElse(no_better, disparity[v], index[v]);
      cost[v] = hn::Min(cost[v], sum[v]);
    }
  }
  HWY_INLINE void flush(std::uint8_t* mirrored) const {
    for (int v = 0; v < V; ++v) hn::StoreU(disparity[v], U8(), mirrored + v * kLanes);
  }
};

/// kHalfScale * 65536 / n: a division less for each pixel.
struct Reciprocal {
  std::int32_t of[511] = {};
  constexpr Reciprocal() {
    for (int n = 1; n < 511; ++n) of[n] = kHalfScale * 65536 / n;
  }
};
constexpr Reciprocal kReciprocal;

/// 255 for a disparity and its two neighbours, when read from kMaxDisparities - disparity on.
struct NearMask {
  std::uint8_t of[2 * kMaxDisparities + kSlack] = {};
  constexpr NearMask() {
    for (int i = -1; i <= 1; ++i) of[kMaxDisparities + i] = 255;
  }
};
constexpr NearMask kNear;

/// Index of the first lane that is set; there is one.
template <int V>
HWY_INLINE int first_set(const hn::Mask<U8> (&masks)[V]) {
#if HWY_TARGET == HWY_AVX2
  for (int v = 0; v + 1 < V; v += 2) {
    const auto low = static_cast<std::uint32_t>(_mm256_movemask_epi8(masks[v].raw));
    const auto high = static_cast<std::uint32_t>(_mm256_movemask_epi8(masks[v + 1].raw));
    const std::uint64_t both = std::uint64_t{high} << 32 | low;
    if (both != 0) return v * kLanes + __builtin_ctzll(both);
  }
  return (V - 1) * kLanes +
         __builtin_ctz(static_cast<std::uint32_t>(_mm256_movemask_epi8(masks[V - 1].raw)));
#else
  for (int v = 0; v + 1 < V; ++v)
    if (const auto i = hn::FindFirstTrue(U8(), masks[v]); i >= 0)
      return v * kLanes + static_cast<int>(i);
  return (V - 1) * kLanes + static_cast<int>(hn::FindFirstTrue(U8(), masks[V - 1]));
#endif
}

/// The best disparity of one pixel, sub-pixel by a parabola through the sums, and by how much it is
/// better than the second best.
template <int V>
HWY_INLINE void find_winner(const Bytes (&sum)[V], int first, std::int16_t& disparity,
                            std::uint8_t& margin) {
  const U8 d;
  alignas(32) std::uint8_t s[V * kLanes];
  Bytes low = sum[0];
  for (int v = 0; v < V; ++v) hn::Store(sum[v], d, s + v * kLanes);
  for (int v = 1; v < V; ++v) low = hn::Min(low, sum[v]);
  const Bytes least = min_everywhere(low);
  hn::Mask<U8> is_least[V];
  for (int v = 0; v < V; ++v) is_least[v] = hn::Eq(sum[v], least);
  const int i = first_set<V>(is_least);
  Bytes second = set(255);
  for (int v = 0; v < V; ++v)
    second =
        hn::Min(second, hn::Or(sum[v], hn::LoadU(d, kNear.of + kMaxDisparities - i + v * kLanes)));
  const int cost = hn::GetLane(least);
  margin = static_cast<std::uint8_t>(hn::GetLane(min_everywhere(second)) - cost);
  int offset = 0;
  if (i > 0 && i + 1 < V * kLanes) {
    const int before = s[i - 1] - cost;
    const int after = s[i + 1] - cost;
    offset = (before - after) * kReciprocal.of[before + after] >> 16;
  }
  disparity = static_cast<std::int16_t>((first + i) * 2 * kHalfScale + offset);
}

template <int V>
struct Sweep {
  const SweepInput& in;
  SweepState& state;
  const SweepOutput& out;
  Bytes bits;  ///< set bits of four
  Bytes index[V];

  Sweep(const SweepInput& i, SweepState& s, const SweepOutput& o) : in(i), state(s), out(o) {
    alignas(16) static constexpr std::uint8_t kBits[16] = {0, 1, 1, 2, 1, 2, 2, 3,
                                                           1, 2, 2, 3, 2, 3, 3, 4};
    bits = hn::LoadDup128(U8(), kBits);
    for (int v = 0; v < V; ++v) index[v] = hn::Iota(U8(), static_cast<std::uint8_t>(v * kLanes));
  }

  /// R rows at a time: while one row waits for the path along it, another works.
  template <int R, int kDirection, bool kFinish>
  void rows(const SweepPart& part) {
    const U8 d;
    const int y0 = part.y;
    const int disparities = V * kLanes;
    const Bytes p1 = set(in.p1);
    const Bytes table = bits;
    const std::ptrdiff_t mirrored_size = in.width + in.first + disparities + 2 * kSlack;
    Path<V> along[R];
    RightWinners<V, kDirection> right[R];
    const std::uint8_t* left_census[R][kCensusPlanes];
    const std::uint8_t* right_census[R][kCensusPlanes];
    const std::uint8_t* p2_along[R];
    const std::uint8_t* p2_down[R];
    std::uint8_t* sums[R];
    std::uint8_t* carried = state.carried;
    for (int r = 0; r < R; ++r) {
      if (part.begin == 0) {
        along[r].clear();
        right[r].clear();
      } else {
        for (int v = 0; v < V; ++v, carried += kLanes) along[r].cost[v] = hn::Load(d, carried);
        if constexpr (kFinish)
          for (int v = 0; v < V; ++v, carried += 2 * kLanes) {
            right[r].cost[v] = hn::Load(d, carried);
            right[r].disparity[v] = hn::Load(d, carried + kLanes);
          }
      }
      const int y = y0 + r * kDirection;
      for (int p = 0; p < kCensusPlanes; ++p) {
        left_census[r][p] = in.left[p] + y * in.left_stride;
        right_census[r][p] = in.right[p] + y * in.right_stride + in.width - 1 + in.first;
      }
      // Where the pixel before this one, in the direction of travel, lies.
      const int below = kDirection < 0 && y + 1 < in.height ? 1 : 0;
      p2_along[r] = in.p2_left + std::ptrdiff_t(y) * in.width + (kDirection < 0 ? 1 : 0);
      p2_down[r] = in.p2_above + std::ptrdiff_t(y + below) * in.width;
      sums[r] = in.sums + std::ptrdiff_t(y) * in.width * disparities;
    }
    const int x_first = kDirection > 0 ? in.first : in.width - 1;
    const int x_last = kDirection > 0 ? in.width - 1 : in.first;
    const int x_end = x_first + part.end * kDirection;
    for (int x = x_first + part.begin * kDirection; x != x_end; x += kDirection) {
      Path<V> down;
      std::uint8_t* path = state.path + std::ptrdiff_t(x) * disparities;
      for (int v = 0; v < V; ++v) down.cost[v] = hn::Load(d, path + v * kLanes);
      for (int r = 0; r < R; ++r) {
        Bytes cost[V];
        for (int v = 0; v < V; ++v) cost[v] = hn::Zero(d);
        for (int p = 0; p < kCensusPlanes; ++p) {
          const Bytes signature = set(left_census[r][p][x]);
          for (int v = 0; v < V; ++v)
            cost[v] = hn::Add(
                cost[v],
                hn::TableLookupBytes(
                    table, hn::Xor(signature, hn::LoadU(d, right_census[r][p] - x + v * kLanes))));
        }
        along[r].step(cost, p1, set(p2_along[r][x]));
        down.step(cost, p1, set(p2_down[r][x]));
        std::uint8_t* pixel_sums = sums[r] + std::ptrdiff_t(x) * disparities;
        Bytes sum[V];
        for (int v = 0; v < V; ++v) sum[v] = hn::Add(along[r].cost[v], down.cost[v]);
        if constexpr (kFinish) {
          for (int v = 0; v < V; ++v)
            sum[v] = hn::SaturatedAdd(sum[v], hn::Load(d, pixel_sums + v * kLanes));
          std::uint8_t* mirrored = state.right_best + r * mirrored_size + kSlack +
                                   (in.width - 1 - (x - kDirection) + in.first);
          right[r].advance(mirrored);
          right[r].offer(sum, index);
          const std::size_t at = std::size_t(y0 + r * kDirection) * in.width + x;
          find_winner<V>(sum, in.first, out.disparity[at], out.margin[at]);
        } else {
          for (int v = 0; v < V; ++v) hn::Stream(sum[v], d, pixel_sums + v * kLanes);
        }
      }
      for (int v = 0; v < V; ++v) hn::Store(down.cost[v], d, path + v * kLanes);
    }
    if (part.end < in.width - in.first) {
      carried = state.carried;
      for (int r = 0; r < R; ++r) {
        for (int v = 0; v < V; ++v, carried += kLanes) hn::Store(along[r].cost[v], d, carried);
        if constexpr (kFinish)
          for (int v = 0; v < V; ++v, carried += 2 * kLanes) {
            hn::Store(right[r].cost[v], d, carried);
            hn::Store(right[r].disparity[v], d, carried + kLanes);
          }
      }
      return;
    }
    if constexpr (kFinish)
      for (int r = 0; r < R; ++r) {
        std::uint8_t* mirrored = state.right_best + r * mirrored_size + kSlack;
        right[r].flush(mirrored + (in.width - 1 - x_last + in.first));
        check(y0 + r * kDirection, mirrored);
      }
  }

  /// Takes back winners that the right image does not agree with, that are hardly better than
  /// another disparity, or that lie at an end of the search.
  void check(int y, const std::uint8_t* mirrored) const {
    std::int16_t* disparity = out.disparity + std::ptrdiff_t(y) * in.width;
    const std::uint8_t* margin = out.margin + std::ptrdiff_t(y) * in.width;
    for (int x = 0; x < in.first; ++x) disparity[x] = 0;
    std::uint32_t near = 0;
    for (int x = in.first; x < in.width; ++x) {
      const int i = (disparity[x] + kHalfScale) / (2 * kHalfScale) - in.first;
      const int right_x = x - in.first - i;
      const int difference = mirrored[in.width - 1 - right_x] - i;
      const bool agreed =
          right_x >= 0 && difference <= out.left_right && -difference <= out.left_right;
      near += agreed && i == V * kLanes - 1 ? 1 : 0;
      const bool good = agreed && margin[x] >= out.uniqueness && i > 0 && i + 1 < V * kLanes;
      disparity[x] = good ? disparity[x] : std::int16_t{0};
    }
    *out.at_near_end += near;
  }

  template <int kDirection>
  void go(const SweepPart& part) {
    if (part.rows == 2)
      part.finish ? rows<2, kDirection, true>(part) : rows<2, kDirection, false>(part);
    else
      part.finish ? rows<1, kDirection, true>(part) : rows<1, kDirection, false>(part);
  }
};

template <int kBlocks>
void sweep_blocks(const SweepInput& in, SweepState& state, const SweepPart& part,
                  const SweepOutput& out) {
  Sweep<kBlocks * kDisparityStep / kLanes> s(in, state, out);
  part.direction > 0 ? s.template go<1>(part) : s.template go<-1>(part);
}

void SweepRows(const SweepInput& in, SweepState& state, const SweepPart& part,
               const SweepOutput& out) {
  switch (in.disparities / kDisparityStep) {
    case 1:
      return sweep_blocks<1>(in, state, part, out);
    case 2:
      return sweep_blocks<2>(in, state, part, out);
    case 3:
      return sweep_blocks<3>(in, state, part, out);
    case 4:
      return sweep_blocks<4>(in, state, part, out);
    case 6:
      return sweep_blocks<6>(in, state, part, out);
    default:
      return sweep_blocks<8>(in, state, part, out);
  }
}

}  // namespace crane::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace crane {

HWY_EXPORT(CensusRow);
HWY_EXPORT(SweepRows);

void census_row(const std::int8_t* padded, std::ptrdiff_t stride, int width, bool mirrored,
                std::uint8_t* const planes[kCensusPlanes]) {
  HWY_DYNAMIC_DISPATCH(CensusRow)(padded, stride, width, mirrored, planes);
}

void sweep(const SweepInput& in, SweepState& state, const SweepPart& part, const SweepOutput& out) {
  HWY_DYNAMIC_DISPATCH(SweepRows)(in, state, part, out);
}

}  // namespace crane
#endif
