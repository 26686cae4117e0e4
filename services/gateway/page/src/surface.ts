// SPDX-License-Identifier: Apache-2.0
// Heights as a surface: a level square a column, and walls where the next one is lower. What is unknown has none.

import { BufferAttribute, BufferGeometry, Color, DoubleSide, Group, Mesh, MeshLambertMaterial, SRGBColorSpace, type Plane } from "three";
import { viridis } from "./colours";
import { EDGE, type Tile, type TileStore } from "./tiles";

export type ColourBy = "height" | "age" | "views";

const MOST_AGE_S = 600; // the scale of ages ends here
const MOST_VIEWS = 32;

export class Surface {
  readonly group = new Group();
  colourBy: ColourBy = "height";
  top_m = 0.5;
  private readonly meshes = new Map<string, Mesh>();
  private readonly material: MeshLambertMaterial;
  private readonly dirty = new Set<string>();

  /** `section`: planes that cut. */
  constructor(private readonly store: TileStore, section: Plane[]) {
    this.material = new MeshLambertMaterial({ vertexColors: true, side: DoubleSide, clippingPlanes: section });
  }

  clear(): void {
    for (const mesh of this.meshes.values()) {
      this.group.remove(mesh);
      mesh.geometry.dispose();
    }
    this.meshes.clear();
    this.top_m = 0.5;
  }

  changed(tiles: Tile[]): void {
    let top = this.top_m;
    for (const tile of tiles) {
      this.dirty.add(`${tile.x},${tile.y}`);
      for (const h of tile.height_m) if (h > top) top = Math.ceil(2 * h) / 2;
    }
    if (top === this.top_m) return;
    this.top_m = top;
    this.all();
  }
  all(): void {
    for (const key of this.store.tiles.keys()) this.dirty.add(key);
  }

  /** Makes anew what changed, within a few milliseconds; true when there was something. */
  update(voxel_m: number, now_ms: number): boolean {
    const until = performance.now() + 12;
    let any = false;
    for (const key of this.dirty) {
      this.dirty.delete(key);
      const tile = this.store.tiles.get(key);
      if (!tile) continue;
      any = true;
      const old = this.meshes.get(key);
      if (old) {
        this.group.remove(old);
        old.geometry.dispose();
      }
      const mesh = new Mesh(this.geometry(tile, voxel_m, now_ms), this.material);
      this.meshes.set(key, mesh);
      this.group.add(mesh);
      if (performance.now() > until) break;
    }
    return any;
  }

  private colour(tile: Tile, i: number, now_ms: number): [number, number, number] {
    if (this.colourBy === "height") return viridis(tile.height_m[i]! / this.top_m);
    if (this.colourBy === "views") return viridis(tile.views[i]! / MOST_VIEWS);
    const age_s = now_ms / 1000 - tile.seen_s[i]!;
    return viridis(1 - Math.log1p(Math.max(0, age_s)) / Math.log1p(MOST_AGE_S));
  }

  /** The height of a column beside; NaN: unknown. */
  private beside(tile: Tile, x: number, y: number): number {
    const dx = Math.floor(x / EDGE);
    const dy = Math.floor(y / EDGE);
    const other = dx === 0 && dy === 0 ? tile : this.store.tiles.get(`${tile.x + dx},${tile.y + dy}`);
    return other ? other.height_m[(y - dy * EDGE) * EDGE + (x - dx * EDGE)]! : NaN;
  }

  private geometry(tile: Tile, voxel: number, now_ms: number): BufferGeometry {
    const positions: number[] = [];
    const normals: number[] = [];
    const colours: number[] = [];
    const colour = new Color();
    const quad = (corners: number[], normal: [number, number, number]): void => {
      for (const k of [0, 1, 2, 0, 2, 3]) {
        positions.push(corners[3 * k]!, corners[3 * k + 1]!, corners[3 * k + 2]!);
        normals.push(...normal);
        colours.push(colour.r, colour.g, colour.b);
      }
    };
    for (let y = 0; y < EDGE; y++)
      for (let x = 0; x < EDGE; x++) {
        const i = y * EDGE + x;
        const z = tile.height_m[i]!;
        if (!Number.isFinite(z)) continue;
        const [r, g, b] = this.colour(tile, i, now_ms);
        const bound = (tile.flags[i]! & 4) !== 0 && (x + y) % 2 === 0 ? 0.45 : 1; // a chequered lower bound
        colour.setRGB(r * bound, g * bound, b * bound, SRGBColorSpace);
        const x0 = (tile.x * EDGE + x) * voxel;
        const y0 = (tile.y * EDGE + y) * voxel;
        const x1 = x0 + voxel;
        const y1 = y0 + voxel;
        quad([x0, y0, z, x1, y0, z, x1, y1, z, x0, y1, z], [0, 0, 1]);
        const walls: [number, number, number[], [number, number, number]][] = [
          [x - 1, y, [x0, y0, x0, y1], [-1, 0, 0]],
          [x + 1, y, [x1, y0, x1, y1], [1, 0, 0]],
          [x, y - 1, [x0, y0, x1, y0], [0, -1, 0]],
          [x, y + 1, [x0, y1, x1, y1], [0, 1, 0]],
        ];
        for (const [bx, by, [ax, ay, cx, cy], normal] of walls as [number, number, [number, number, number, number], [number, number, number]][]) {
          const low = this.beside(tile, bx, by);
          if (low < z) quad([ax, ay, low, cx, cy, low, cx, cy, z, ax, ay, z], normal);
        }
      }
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(new Float32Array(positions), 3));
    geometry.setAttribute("normal", new BufferAttribute(new Float32Array(normals), 3));
    geometry.setAttribute("color", new BufferAttribute(new Float32Array(colours), 3));
    return geometry;
  }
}
