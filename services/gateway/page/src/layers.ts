// SPDX-License-Identifier: Apache-2.0
// The tiles as three pictures, a pixel a column, row 0 the highest y: heights, and masks of what is a lower
// bound and what is stale. What is unknown stays transparent: the hatching below it shows.

import { EDGE, Surface, type Tile, type TileStore } from "./tiles";

const MOST_TILES = 256; // along one axis: 8192 pixels

function picture(width: number, height: number): CanvasRenderingContext2D {
  const canvas = document.createElement("canvas");
  canvas.width = width;
  canvas.height = height;
  return canvas.getContext("2d")!;
}

/** Grey of a height, 0 (floor) to 1 (highest). */
export function grey(share: number, dark: boolean): number {
  const s = Math.min(1, Math.max(0, share));
  return Math.round(dark ? 62 + 178 * s : 244 - 188 * s);
}

export class Layers {
  heights = picture(1, 1);
  bounds = picture(1, 1);
  stale = picture(1, 1);
  low = { x: 0, y: 0 }; // tiles
  high = { x: -1, y: -1 };
  top_m = 0.5; // of the scale of greys
  leftOut = 0;
  /** Of the columns that were ever seen, in columns; empty: from > to. */
  seen = { x0: Infinity, y0: Infinity, x1: -Infinity, y1: -Infinity };
  private readonly pixels = new ImageData(EDGE, EDGE);

  constructor(private readonly dark: boolean) {}

  get empty(): boolean {
    return this.high.x < this.low.x;
  }

  /** All of it anew. */
  rebuild(store: TileStore): void {
    this.low = { x: 0, y: 0 };
    this.high = { x: -1, y: -1 };
    this.top_m = 0.5;
    this.leftOut = 0;
    this.seen = { x0: Infinity, y0: Infinity, x1: -Infinity, y1: -Infinity };
    this.add([...store.tiles.values()], store);
  }

  add(tiles: Tile[], store: TileStore): void {
    let top = this.top_m;
    for (const tile of tiles)
      for (const h of tile.height_m) if (h > top) top = Math.ceil(2 * h) / 2;
    const grown = this.grow(tiles);
    const all = grown || top !== this.top_m;
    this.top_m = top;
    for (const tile of all ? store.tiles.values() : tiles) this.draw(tile);
  }

  /** True when the pictures are new and empty. */
  private grow(tiles: Tile[]): boolean {
    const low = { ...this.low };
    const high = { ...this.high };
    for (const t of tiles) {
      const first = high.x < low.x;
      const l = first ? { x: t.x, y: t.y } : { x: Math.min(low.x, t.x), y: Math.min(low.y, t.y) };
      const h = first ? { x: t.x, y: t.y } : { x: Math.max(high.x, t.x), y: Math.max(high.y, t.y) };
      if (h.x - l.x >= MOST_TILES || h.y - l.y >= MOST_TILES) {
        this.leftOut++;
        continue;
      }
      Object.assign(low, l);
      Object.assign(high, h);
    }
    if (low.x === this.low.x && low.y === this.low.y && high.x === this.high.x && high.y === this.high.y)
      return false;
    this.low = low;
    this.high = high;
    const width = (high.x - low.x + 1) * EDGE;
    const height = (high.y - low.y + 1) * EDGE;
    this.heights = picture(width, height);
    this.bounds = picture(width, height);
    this.stale = picture(width, height);
    return true;
  }

  private note(tile: Tile): void {
    for (let i = 0; i < EDGE * EDGE; i++) {
      if (tile.flags[i] === 0) continue;
      const x = tile.x * EDGE + (i % EDGE);
      const y = tile.y * EDGE + Math.floor(i / EDGE);
      this.seen.x0 = Math.min(this.seen.x0, x);
      this.seen.y0 = Math.min(this.seen.y0, y);
      this.seen.x1 = Math.max(this.seen.x1, x + 1);
      this.seen.y1 = Math.max(this.seen.y1, y + 1);
    }
  }

  private draw(tile: Tile): void {
    if (tile.x < this.low.x || tile.x > this.high.x || tile.y < this.low.y || tile.y > this.high.y) return;
    this.note(tile);
    const put = (
      to: CanvasRenderingContext2D,
      pixel: (i: number, flags: number) => number | null, // grey; null: transparent
    ): void => {
      const data = this.pixels.data;
      for (let i = 0; i < EDGE * EDGE; i++) {
        const at = 4 * ((EDGE - 1 - Math.floor(i / EDGE)) * EDGE + (i % EDGE));
        const value = pixel(i, tile.flags[i]!);
        data[at] = data[at + 1] = data[at + 2] = value ?? 0;
        data[at + 3] = value === null ? 0 : 255;
      }
      to.putImageData(this.pixels, (tile.x - this.low.x) * EDGE, (this.high.y - tile.y) * EDGE);
    };
    const known = (flags: number) => (flags & 3) === Surface.floor || (flags & 3) === Surface.obstacle;
    put(this.heights, (i, flags) =>
      known(flags) ? grey(tile.height_m[i]! / this.top_m, this.dark) : null,
    );
    put(this.bounds, (_i, flags) => (known(flags) && (flags & 4) !== 0 ? 0 : null));
    put(this.stale, (_i, flags) => ((flags & 3) === Surface.stale ? 0 : null));
  }
}
