// SPDX-License-Identifier: Apache-2.0
import type { Vector3 } from "three";
import { EDGE, type TileStore, type Tile } from "./tiles";

export interface Picked {
  x: number; // middle of the column
  y: number;
  tile: Tile;
  index: number;
}

/** The first column whose known surface a ray meets; null: none within `most_m`. Where not `keeps(p)` it is cut away. */
export function pick(store: TileStore, voxel: number, from: Vector3, way: Vector3, keeps: (p: Vector3) => boolean = () => true, most_m = 200): Picked | null {
  if (!(voxel > 0)) return null;
  const step = voxel / 3;
  const p = from.clone();
  for (let t = 0; t < most_m; t += step) {
    p.addScaledVector(way, step);
    if (p.z < -2 && way.z < 0) return null;
    const cx = Math.floor(p.x / voxel);
    const cy = Math.floor(p.y / voxel);
    const tile = store.tiles.get(`${Math.floor(cx / EDGE)},${Math.floor(cy / EDGE)}`);
    if (!tile) continue;
    const index = (cy - tile.y * EDGE) * EDGE + (cx - tile.x * EDGE);
    if (p.z <= tile.height_m[index]! && keeps(p)) return { x: (cx + 0.5) * voxel, y: (cy + 0.5) * voxel, tile, index };
  }
  return null;
}
