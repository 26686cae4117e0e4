// SPDX-License-Identifier: Apache-2.0
// The map from above, and over it what the crane is and may do. Grey is normal; colour means abnormal, and never
// stands alone.

import type { Clearance, State, Zone } from "./state";
import { texts, theme, metres } from "./settings";
import { Layers } from "./layers";
import { EDGE } from "./tiles";
import { View, type Point } from "./view";

const dark = theme === "dark";
export const INK = dark ? "#f0f0f0" : "#111111";
const PAPER = dark ? "#1d1f21" : "#ffffff";
const FAINT = dark ? "#8d9196" : "#62666b";
const AMBER = dark ? "#ffb000" : "#8f5200";

/** A tile of a pattern, drawn by `paint` on size x size pixels. */
function pattern(size: number, paint: (c: CanvasRenderingContext2D) => void): CanvasPattern {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = size;
  const c = canvas.getContext("2d")!;
  paint(c);
  return c.createPattern(canvas, "repeat")!;
}

function lines(size: number, back: string | null, colour: string, width: number, cross: boolean): CanvasPattern {
  return pattern(size, (c) => {
    if (back !== null) {
      c.fillStyle = back;
      c.fillRect(0, 0, size, size);
    }
    c.strokeStyle = colour;
    c.lineWidth = width;
    c.beginPath();
    for (const o of [-size, 0, size]) {
      c.moveTo(o, size);
      c.lineTo(o + size, 0);
      if (cross) {
        c.moveTo(o, 0);
        c.lineTo(o + size, size);
      }
    }
    c.stroke();
  });
}

export const HATCH = lines(10, dark ? "#2c2f33" : "#c3c6c9", dark ? "#70757b" : "#7d8287", 1.6, false);
export const CROSS = lines(10, dark ? "#2c2f33" : "#c3c6c9", dark ? "#b3b8be" : "#3f4347", 1.4, true);
export const DOTS = pattern(8, (c) => {
  c.fillStyle = dark ? "#000000" : "#ffffff";
  c.fillRect(0, 0, 4, 4);
  c.fillStyle = dark ? "#ffffff" : "#000000";
  c.fillRect(1, 1, 2, 2);
});
const ZONE_LINES = lines(16, null, INK, 1.6, false);

export interface Overlay {
  state: State | null;
  path: Point[]; // as drawn
  swept_m: number; // width of what load and margins may sweep, however it is turned
  answer: Clearance | null;
  load: { x: number; y: number; size_x_m: number; size_y_m: number; yaw_rad: number } | null;
  column: Point | null;
}

export class Picture {
  readonly view = new View();
  readonly layers = new Layers(dark);
  private readonly context: CanvasRenderingContext2D;
  private readonly scratch = document.createElement("canvas");

  constructor(readonly canvas: HTMLCanvasElement) {
    this.context = canvas.getContext("2d")!;
  }

  /** True when it has another size now. */
  resize(): boolean {
    const ratio = window.devicePixelRatio || 1;
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (this.view.width === width && this.view.height === height) return false;
    this.view.width = width;
    this.view.height = height;
    this.canvas.width = Math.round(width * ratio);
    this.canvas.height = Math.round(height * ratio);
    return true;
  }

  /** All that was ever seen. */
  fit(voxel_m: number): void {
    const { x0, y0, x1, y1 } = this.layers.seen;
    if (x1 <= x0 || voxel_m <= 0) return;
    this.view.fit({ x: x0 * voxel_m, y: y0 * voxel_m }, { x: x1 * voxel_m, y: y1 * voxel_m });
  }

  draw(o: Overlay): void {
    const c = this.context;
    const ratio = this.canvas.width / Math.max(1, this.view.width);
    c.setTransform(ratio, 0, 0, ratio, 0, 0);
    c.fillStyle = HATCH;
    c.fillRect(0, 0, this.view.width, this.view.height);
    const voxel = o.state?.map.voxel_m ?? 0;
    if (!this.layers.empty && voxel > 0) this.drawLayers(voxel, ratio);
    this.drawScale();
    if (o.state) {
      for (const zone of o.state.zones) this.drawZone(zone);
      this.drawCrane(o.state);
    }
    if (o.load) this.drawLoad(o.load);
    if (o.path.length > 0) this.drawPath(o);
    if (o.column) this.drawColumn(o.column);
  }

  private drawLayers(voxel: number, ratio: number): void {
    const { low, high, heights, bounds, stale } = this.layers;
    const tile = EDGE * voxel;
    const a = this.view.toPixels({ x: low.x * tile, y: (high.y + 1) * tile });
    const b = this.view.toPixels({ x: (high.x + 1) * tile, y: low.y * tile });
    const rect = [a.x, a.y, b.x - a.x, b.y - a.y] as const;
    const c = this.context;
    c.imageSmoothingEnabled = false;
    c.drawImage(heights.canvas, ...rect);
    for (const [mask, fill] of [
      [stale, CROSS],
      [bounds, DOTS],
    ] as const) {
      this.scratch.width = this.canvas.width;
      this.scratch.height = this.canvas.height;
      const s = this.scratch.getContext("2d")!;
      s.setTransform(ratio, 0, 0, ratio, 0, 0);
      s.imageSmoothingEnabled = false;
      s.drawImage(mask.canvas, ...rect);
      s.globalCompositeOperation = "source-in";
      s.fillStyle = fill;
      s.fillRect(0, 0, this.view.width, this.view.height);
      c.drawImage(this.scratch, 0, 0, this.view.width, this.view.height);
    }
  }

  private trace(points: Point[], close: boolean): void {
    const c = this.context;
    c.beginPath();
    points.forEach((p, i) => {
      const at = this.view.toPixels(p);
      if (i === 0) c.moveTo(at.x, at.y);
      else c.lineTo(at.x, at.y);
    });
    if (close) c.closePath();
  }

  /** A line that shows on every grey. */
  private stroke(width: number, colour: string, dash: number[] = []): void {
    const c = this.context;
    c.lineJoin = c.lineCap = "round";
    c.setLineDash([]);
    c.strokeStyle = PAPER;
    c.lineWidth = width + 3;
    c.stroke();
    c.setLineDash(dash);
    c.strokeStyle = colour;
    c.lineWidth = width;
    c.stroke();
    c.setLineDash([]);
  }

  private label(text: string, at: Point, size = 14, colour = INK): void {
    const c = this.context;
    c.font = `600 ${size}px system-ui, sans-serif`;
    c.textAlign = "center";
    c.textBaseline = "middle";
    const width = c.measureText(text).width + 10;
    const x = Math.min(Math.max(at.x, width / 2), this.view.width - width / 2);
    const y = Math.min(Math.max(at.y, size), this.view.height - size);
    c.fillStyle = PAPER;
    c.fillRect(x - width / 2, y - size * 0.75, width, size * 1.5);
    c.fillStyle = colour;
    c.fillText(text, x, y + 1);
  }

  private drawZone(zone: Zone): void {
    const points = zone.corners.map(([x, y]) => ({ x, y }));
    this.trace(points, true);
    if (zone.active && zone.kind === "no_go") {
      this.context.fillStyle = ZONE_LINES;
      this.context.fill();
    }
    const width = zone.active ? 3 : 1.5;
    this.stroke(width, zone.active ? INK : FAINT, zone.active && zone.kind === "no_go" ? [] : [10, 7]);
    const middle = {
      x: points.reduce((sum, p) => sum + p.x, 0) / points.length,
      y: points.reduce((sum, p) => sum + p.y, 0) / points.length,
    };
    const word = zone.kind === "no_go" ? texts.zone_no_go : texts.zone_slow;
    this.label(`${word}${zone.active ? "" : ` (${texts.zone_off})`} ${zone.name}`.trim(), this.view.toPixels(middle), 13);
  }

  private drawCrane(state: State): void {
    if (state.footprint.length === 4) {
      this.trace(
        state.footprint.map(([x, y]) => ({ x, y })),
        true,
      );
      this.stroke(1.5, INK, [2, 5]);
    }
    if (!state.position) return;
    const { x_m: x, y_m: y } = state.position;
    const at = this.view.toPixels({ x, y });
    const c = this.context;
    // The bridge lies across, the trolley on it.
    c.beginPath();
    c.moveTo(at.x, 0);
    c.lineTo(at.x, this.view.height);
    this.stroke(1, FAINT, [14, 6, 2, 6]);
    c.beginPath();
    c.moveTo(at.x - 13, at.y);
    c.lineTo(at.x + 13, at.y);
    c.moveTo(at.x, at.y - 13);
    c.lineTo(at.x, at.y + 13);
    this.stroke(3, INK);
  }

  private drawLoad(load: NonNullable<Overlay["load"]>): void {
    const cos = Math.cos(load.yaw_rad);
    const sin = Math.sin(load.yaw_rad);
    const corner = (u: number, v: number): Point => ({
      x: load.x + u * load.size_x_m * cos - v * load.size_y_m * sin,
      y: load.y + u * load.size_x_m * sin + v * load.size_y_m * cos,
    });
    this.trace([corner(-0.5, -0.5), corner(0.5, -0.5), corner(0.5, 0.5), corner(-0.5, 0.5)], true);
    this.stroke(2.5, INK);
  }

  private drawPath(o: Overlay): void {
    this.trace(o.path, false);
    this.context.lineCap = this.context.lineJoin = "round";
    this.context.lineWidth = o.swept_m * this.view.scale;
    this.context.strokeStyle = dark ? "rgba(255,255,255,0.22)" : "rgba(0,0,0,0.16)";
    this.context.stroke();
    this.trace(o.path, false);
    this.stroke(4, INK, o.answer?.verdict === "clear" ? [] : [9, 9]);
    const start = this.view.toPixels(o.path[0]!);
    this.context.beginPath();
    this.context.arc(start.x, start.y, 6, 0, 2 * Math.PI);
    this.stroke(3, INK);
    const block = o.answer?.first_blocking;
    if (!block) return;
    const at = this.view.toPixels({ x: block.x_m, y: block.y_m });
    const c = this.context;
    const r = 15;
    c.beginPath();
    c.rect(at.x - r, at.y - r, 2 * r, 2 * r);
    c.moveTo(at.x - r, at.y - r);
    c.lineTo(at.x + r, at.y + r);
    c.moveTo(at.x + r, at.y - r);
    c.lineTo(at.x - r, at.y + r);
    this.stroke(4, AMBER);
    this.label(`${texts.block_here}, ${metres(block.z_m)}`, { x: at.x, y: at.y + r + 18 }, 14, AMBER);
  }

  private drawColumn(p: Point): void {
    const at = this.view.toPixels(p);
    this.context.beginPath();
    this.context.arc(at.x, at.y, 9, 0, 2 * Math.PI);
    this.context.moveTo(at.x - 3, at.y);
    this.context.lineTo(at.x + 3, at.y);
    this.context.moveTo(at.x, at.y - 3);
    this.context.lineTo(at.x, at.y + 3);
    this.stroke(2, INK);
  }

  private drawScale(): void {
    const steps = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50];
    const step = steps.find((s) => s * this.view.scale >= 60) ?? 100;
    const x = 14;
    const y = this.view.height - 16;
    const width = step * this.view.scale;
    const c = this.context;
    c.beginPath();
    c.moveTo(x, y - 6);
    c.lineTo(x, y);
    c.lineTo(x + width, y);
    c.lineTo(x + width, y - 6);
    this.stroke(2, INK);
    this.label(`${step} m`, { x: x + width / 2, y: y - 18 }, 13);
  }
}
