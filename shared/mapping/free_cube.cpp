// SPDX-License-Identifier: Apache-2.0
// No Eigen, OpenCV or standard containers here: what this file compiles with wide instructions must
// not be merged by the linker into code for every processor.
#include "mapping/free_cube.hpp"

#include "base/simd_targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "mapping/free_cube.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace crane::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

void FreeOfCube(const FreeProjection& p, const float first[3], std::uint8_t* masks) {
  const hn::CappedTag<float, kFreeCube> d;
  const hn::RebindToSigned<decltype(d)> di;
  const int lanes = static_cast<int>(hn::Lanes(d));
  const auto zero = hn::Zero(d);
  const auto columns = hn::Set(d, float(p.columns));
  const auto rows = hn::Set(d, float(p.rows));
  const auto focal = hn::Set(d, p.focal);
  const auto along = hn::Iota(d, 0.0F);
  for (int z = 0; z < kFreeCube; ++z)
    for (int y = 0; y < kFreeCube; ++y) {
      float start[3];
      for (int axis = 0; axis < 3; ++axis)
        start[axis] = first[axis] + float(y) * p.step[1][axis] + float(z) * p.step[2][axis];
      unsigned mask = 0;
      for (int x = 0; x < kFreeCube; x += lanes) {
        const auto n = hn::Add(along, hn::Set(d, float(x)));
        const auto at = [&](int axis) {
          return hn::MulAdd(n, hn::Set(d, p.step[0][axis]), hn::Set(d, start[axis]));
        };
        const auto depth = at(2);
        const auto scale = hn::Div(focal, depth);
        const auto u = hn::MulAdd(at(0), scale, hn::Set(d, p.cu));
        const auto v = hn::MulAdd(at(1), scale, hn::Set(d, p.cv));
        const auto inside = hn::And(hn::And(hn::And(hn::Ge(u, zero), hn::Ge(v, zero)),
                                            hn::And(hn::Lt(u, columns), hn::Lt(v, rows))),
                                    hn::Ge(depth, hn::Set(d, p.near_m)));
        const auto cell = hn::Add(
            hn::Mul(hn::ConvertTo(di, hn::IfThenElseZero(inside, v)), hn::Set(di, p.columns)),
            hn::ConvertTo(di, hn::IfThenElseZero(inside, u)));
        const auto open = hn::GatherIndex(d, p.cells, cell);
        const auto free = hn::And(inside, hn::Lt(hn::Add(depth, hn::Set(d, p.reach_m)), open));
        std::uint8_t bits[8] = {};
        hn::StoreMaskBits(d, free, bits);
        mask |= unsigned{bits[0]} << x;
      }
      masks[kFreeCube * z + y] = static_cast<std::uint8_t>(mask);
    }
}

CubeBounds BoundsOfCube(const FreeProjection& p, const float first[3], int edge) {
  const hn::CappedTag<float, 8> d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  alignas(32) static constexpr float kCorner[3][8] = {
      {0, 1, 0, 1, 0, 1, 0, 1}, {0, 0, 1, 1, 0, 0, 1, 1}, {0, 0, 0, 0, 1, 1, 1, 1}};
  const auto length = static_cast<float>(edge - 1);
  CubeBounds out{};
  for (int c = 0; c < 8; c += lanes) {
    const auto at = [&](int axis) {
      auto sum = hn::Mul(hn::Set(d, length * p.step[0][axis]), hn::Load(d, kCorner[0] + c));
      for (int k = 1; k < 3; ++k)
        sum = hn::Add(sum,
                      hn::Mul(hn::Set(d, length * p.step[k][axis]), hn::Load(d, kCorner[k] + c)));
      return hn::Add(hn::Set(d, first[axis]), sum);
    };
    const auto z = at(2);
    const auto scale = hn::Div(hn::Set(d, p.focal), hn::Max(z, hn::Set(d, p.near_m)));
    const auto u = hn::Mul(at(0), scale);
    const auto v = hn::Mul(at(1), scale);
    const auto low = [&](auto of) { return hn::GetLane(hn::MinOfLanes(d, of)); };
    const auto high = [&](auto of) { return hn::GetLane(hn::MaxOfLanes(d, of)); };
    const CubeBounds part{low(z), high(z), low(u), low(v), high(u), high(v)};
    const auto least = [c](float& so_far, float now) {
      if (c == 0 || now < so_far) so_far = now;
    };
    const auto most = [c](float& so_far, float now) {
      if (c == 0 || now > so_far) so_far = now;
    };
    least(out.near_m, part.near_m), most(out.far_m, part.far_m);
    least(out.u0, part.u0), least(out.v0, part.v0);
    most(out.u1, part.u1), most(out.v1, part.v1);
  }
  out.u0 += p.cu, out.u1 += p.cu;
  out.v0 += p.cv, out.v1 += p.cv;
  return out;
}

}  // namespace crane::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace crane {
HWY_EXPORT(FreeOfCube);
HWY_EXPORT(BoundsOfCube);

void free_of_cube(const FreeProjection& projection, const float first[3],
                  std::uint8_t masks[kFreeCube * kFreeCube]) {
  HWY_DYNAMIC_DISPATCH(FreeOfCube)(projection, first, masks);
}
CubeBounds bounds_of_cube(const FreeProjection& projection, const float first[3], int edge) {
  return HWY_DYNAMIC_DISPATCH(BoundsOfCube)(projection, first, edge);
}
}  // namespace crane
#endif
