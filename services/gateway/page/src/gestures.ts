// SPDX-License-Identifier: Apache-2.0
// Fingers, mouse and keys on the map: drag moves it, two fingers or the wheel zoom, a tap reads a column; while
// drawing, a drag is a path.

import type { Point, View } from "./view";

const TAP_PX = 6;
const STEP_M = 0.02; // between points of a path

export interface Does {
  moved(): void;
  tapped(p: Point): void;
  drawn(points: Point[], done: boolean): void;
}

export class Gestures {
  drawing = false;
  private readonly down = new Map<number, Point>();
  private start: Point | null = null; // of a tap
  private points: Point[] = [];

  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly view: View,
    private readonly does: Does,
  ) {
    canvas.addEventListener("pointerdown", (e) => this.press(e));
    canvas.addEventListener("pointermove", (e) => this.move(e));
    canvas.addEventListener("pointerup", (e) => this.release(e, true));
    canvas.addEventListener("pointercancel", (e) => this.release(e, false));
    canvas.addEventListener("wheel", (e) => {
      e.preventDefault();
      view.zoom(Math.exp(-e.deltaY / 400), { x: e.offsetX, y: e.offsetY });
      does.moved();
    });
    canvas.addEventListener("keydown", (e) => this.key(e));
  }

  private press(e: PointerEvent): void {
    this.canvas.setPointerCapture(e.pointerId);
    const at = { x: e.offsetX, y: e.offsetY };
    this.down.set(e.pointerId, at);
    this.start = this.down.size === 1 ? at : null;
    this.points = this.drawing && this.down.size === 1 ? [this.view.toMetres(at)] : [];
  }

  private move(e: PointerEvent): void {
    const old = this.down.get(e.pointerId);
    if (!old) return;
    const at = { x: e.offsetX, y: e.offsetY };
    if (this.points.length > 0) {
      const p = this.view.toMetres(at);
      const last = this.points[this.points.length - 1]!;
      if (Math.hypot(p.x - last.x, p.y - last.y) < STEP_M) return;
      this.points.push(p);
      return this.does.drawn(this.points, false);
    }
    if (this.start && Math.hypot(at.x - this.start.x, at.y - this.start.y) > TAP_PX) this.start = null;
    if (this.start) return;
    const other = [...this.down].find(([id]) => id !== e.pointerId)?.[1];
    if (other) {
      const before = Math.hypot(old.x - other.x, old.y - other.y);
      const now = Math.hypot(at.x - other.x, at.y - other.y);
      if (before > 0) this.view.zoom(now / before, other);
    } else {
      this.view.pan(at.x - old.x, at.y - old.y);
    }
    this.down.set(e.pointerId, at);
    this.does.moved();
  }

  private release(e: PointerEvent, meant: boolean): void {
    if (!this.down.delete(e.pointerId)) return;
    if (this.points.length > 1) {
      this.does.drawn(this.points, true);
    } else if (meant && this.start) {
      this.does.tapped(this.view.toMetres(this.start));
    }
    this.points = [];
    this.start = null;
  }

  private key(e: KeyboardEvent): void {
    const step = 60;
    const middle = { x: this.view.width / 2, y: this.view.height / 2 };
    if (e.key === "+") this.view.zoom(1.25, middle);
    else if (e.key === "-") this.view.zoom(0.8, middle);
    else if (e.key === "ArrowLeft") this.view.pan(step, 0);
    else if (e.key === "ArrowRight") this.view.pan(-step, 0);
    else if (e.key === "ArrowUp") this.view.pan(0, step);
    else if (e.key === "ArrowDown") this.view.pan(0, -step);
    else if (e.key === "Enter") this.does.tapped(this.view.middle);
    else return;
    e.preventDefault();
    this.does.moved();
  }
}
