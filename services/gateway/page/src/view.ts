// SPDX-License-Identifier: Apache-2.0
// Where the map lies on the canvas: metres (y up) to pixels (y down).

export interface Point {
  x: number;
  y: number;
}

export class View {
  width = 1;
  height = 1;
  scale = 50; // pixels a metre
  middle: Point = { x: 0, y: 0 }; // metres

  toPixels(p: Point): Point {
    return {
      x: this.width / 2 + (p.x - this.middle.x) * this.scale,
      y: this.height / 2 - (p.y - this.middle.y) * this.scale,
    };
  }
  toMetres(p: Point): Point {
    return {
      x: this.middle.x + (p.x - this.width / 2) / this.scale,
      y: this.middle.y - (p.y - this.height / 2) / this.scale,
    };
  }
  fit(low: Point, high: Point): void {
    this.middle = { x: (low.x + high.x) / 2, y: (low.y + high.y) / 2 };
    const border = 0.8; // tools and legend lie over the rest
    const scale = border * Math.min(this.width / (high.x - low.x), this.height / (high.y - low.y));
    this.scale = Math.min(1000, Math.max(2, scale));
  }
  /** A point of the map stays where it is on the canvas. */
  zoom(factor: number, at: Point): void {
    const fixed = this.toMetres(at);
    this.scale = Math.min(2000, Math.max(2, this.scale * factor));
    const now = this.toMetres(at);
    this.middle.x += fixed.x - now.x;
    this.middle.y += fixed.y - now.y;
  }
  pan(dx: number, dy: number): void {
    this.middle.x -= dx / this.scale;
    this.middle.y += dy / this.scale;
  }
}
