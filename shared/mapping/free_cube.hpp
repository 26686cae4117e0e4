// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

namespace crane {

/// Edge of the cubes of voxels that are looked at together.
inline constexpr int kFreeCube = 8;

/// How voxels fall on the cells of FreeDepth. Plain values: this header is all that the translation
/// unit with wide instructions shares with the rest.
struct FreeProjection {
  const float* cells = nullptr;  ///< up to which depth a cell's rays pass free [m]
  int columns = 0, rows = 0;
  float step[3][3] = {};  ///< [axis of the map][camera x y z]: from a voxel to the next [m]
  float focal = 0, cu = 0, cv = 0;  ///< in cells
  float reach_m = 0;                ///< from a voxel's centre to its farthest point along the view
  float near_m = 0;                 ///< voxels nearer to the camera are not looked at
};

/// Which voxels of a cube are seen through. `first`: centre of the voxel with the lowest indices,
/// in the camera [m]. Out: masks[8 * z + y], bit x. Compiled for several instruction sets, chosen
/// at run time.
void free_of_cube(const FreeProjection& projection, const float first[3],
                  std::uint8_t masks[kFreeCube * kFreeCube]);

/// Where the centres of the voxels of a cube can lie: the hull of those at its corners.
struct CubeBounds {
  float near_m, far_m;   ///< depths
  float u0, v0, u1, v1;  ///< in cells, of what is not nearer than near_m of the projection
};
CubeBounds bounds_of_cube(const FreeProjection& projection, const float first[3], int edge);

}  // namespace crane
