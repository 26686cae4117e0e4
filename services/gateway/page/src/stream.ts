// SPDX-License-Identifier: Apache-2.0
// The connection to the gateway: newest state and tiles, made anew whenever it ends.

import type { State } from "./state";
import { readTiles, type TileMessage } from "./tiles";

/** States come five times a second: who hears none for so long has lost the gateway. */
const LOST_MS = 1500;
const AGAIN_MS = 700;

export interface Listener {
  state(state: State): void;
  tiles(message: TileMessage): void;
}

export class Stream {
  private heard = -Infinity;
  private socket: WebSocket | null = null;
  private stopped = false;

  constructor(private readonly listener: Listener) {
    this.open();
  }

  lost(): boolean {
    return performance.now() - this.heard > LOST_MS;
  }
  /** Since when nothing was heard [s]; infinite: never anything. */
  silence_s(): number {
    return (performance.now() - this.heard) / 1000;
  }
  stop(): void {
    this.stopped = true;
    this.socket?.close();
  }

  private open(): void {
    const url = new URL("/api/v1/stream", location.href);
    url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
    const socket = new WebSocket(url);
    this.socket = socket;
    socket.binaryType = "arraybuffer";
    socket.onmessage = (event) => {
      this.heard = performance.now();
      if (typeof event.data === "string") this.listener.state(JSON.parse(event.data) as State);
      else this.listener.tiles(readTiles(event.data as ArrayBuffer));
    };
    // One that is half open tells nothing: it is given up.
    const watch = setInterval(() => {
      if (this.lost() && socket.readyState === WebSocket.OPEN) socket.close();
    }, LOST_MS * 2);
    socket.onclose = () => {
      clearInterval(watch);
      if (!this.stopped) setTimeout(() => this.open(), AGAIN_MS);
    };
  }
}
