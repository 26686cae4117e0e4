// SPDX-License-Identifier: Apache-2.0
// Heights as the stream brings them: tiles of 32 x 32 columns, index y * 32 + x.

export const EDGE = 32;
const COLUMNS = EDGE * EDGE;
const BYTES = 8 + COLUMNS * 10;
const MAGIC = 0x31544d43;

export const enum Surface {
  unknown = 0,
  floor = 1,
  obstacle = 2,
  stale = 3,
}

export interface Tile {
  x: number;
  y: number;
  height_m: Float32Array; // NaN: none
  seen_s: Uint32Array; // Unix epoch, 0: never
  flags: Uint8Array; // Surface, plus 4: the height is a lower bound
  views: Uint8Array;
}

export interface TileMessage {
  generation: number;
  tiles: Tile[];
}

/** Throws when the message breaks its format. */
export function readTiles(message: ArrayBuffer): TileMessage {
  const head = new Uint32Array(message, 0, 4);
  const count = head[2]!;
  if (head[0] !== MAGIC || message.byteLength !== 16 + count * BYTES)
    throw new Error("a message of tiles breaks its format");
  const tiles: Tile[] = [];
  for (let i = 0; i < count; i++) {
    const at = 16 + i * BYTES;
    const key = new Int32Array(message, at, 2);
    tiles.push({
      x: key[0]!,
      y: key[1]!,
      height_m: new Float32Array(message, at + 8, COLUMNS),
      seen_s: new Uint32Array(message, at + 8 + 4 * COLUMNS, COLUMNS),
      flags: new Uint8Array(message, at + 8 + 8 * COLUMNS, COLUMNS),
      views: new Uint8Array(message, at + 8 + 9 * COLUMNS, COLUMNS),
    });
  }
  return { generation: head[1]!, tiles };
}

/** All tiles of one map. */
export class TileStore {
  generation = 0;
  readonly tiles = new Map<string, Tile>();
  /** True when it is another map than before: all of the old one is gone. */
  put(message: TileMessage): boolean {
    const anew = this.begin(message.generation);
    for (const tile of message.tiles) this.tiles.set(`${tile.x},${tile.y}`, tile);
    return anew;
  }
  begin(generation: number): boolean {
    if (generation === this.generation) return false;
    this.generation = generation;
    this.tiles.clear();
    return true;
  }
}
