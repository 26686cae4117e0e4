// SPDX-License-Identifier: Apache-2.0
// Two clicks on the surface: how far apart, and along each axis. As fine as the columns are.

import { BufferGeometry, Group, Line, LineBasicMaterial, Vector3 } from "three";
import { byId, facts, make, replace } from "./dom";
import { metres, texts, theme } from "./settings";

const CLICK_PX = 5; // moved farther, it turned the view

export class Measure {
  readonly group = new Group();
  private readonly points: Vector3[] = [];
  private readonly ink = new LineBasicMaterial({ color: theme === "dark" ? "#ffffff" : "#000000", depthTest: false });
  private on = false;
  private down: [number, number] | null = null;

  /** `at`: the point of the surface below a pixel of the canvas, null where there is none. */
  constructor(
    canvas: HTMLCanvasElement,
    private readonly at: (x: number, y: number) => Vector3 | null,
    private readonly changed: () => void,
  ) {
    const button = byId<HTMLButtonElement>("measure");
    button.textContent = texts.measure;
    byId("measured-title").textContent = texts.measured;
    const turn = (on: boolean) => {
      this.on = on;
      button.setAttribute("aria-pressed", String(on));
      this.points.length = 0;
      this.show();
    };
    button.onclick = () => turn(!this.on);
    addEventListener("keydown", (e) => {
      if (e.ctrlKey || e.altKey || e.metaKey || e.target instanceof HTMLSelectElement) return;
      if (e.key === "m" || e.key === "M") turn(!this.on);
      if (e.key === "Escape" && this.on) turn(false);
    });
    canvas.addEventListener("pointerdown", (e) => (this.down = [e.offsetX, e.offsetY]));
    canvas.addEventListener("pointerup", (e) => {
      const [x, y] = this.down ?? [Infinity, Infinity];
      this.down = null;
      if (this.on && Math.hypot(e.offsetX - x, e.offsetY - y) < CLICK_PX) this.click(e.offsetX, e.offsetY);
    });
    turn(false);
  }

  private click(x: number, y: number): void {
    const point = this.at(x, y);
    if (!point) return;
    if (this.points.length === 2) this.points.length = 0;
    this.points.push(point);
    this.show();
  }

  private show(): void {
    for (const child of [...this.group.children]) {
      this.group.remove(child);
      (child as Line).geometry.dispose();
    }
    const line = (...points: Vector3[]) => {
      const drawn = new Line(new BufferGeometry().setFromPoints(points), this.ink);
      drawn.renderOrder = 1;
      this.group.add(drawn);
    };
    const [a, b] = this.points;
    const arm = 0.05;
    for (const p of this.points)
      for (const way of [new Vector3(arm, 0, 0), new Vector3(0, arm, 0), new Vector3(0, 0, arm)])
        line(p.clone().sub(way), p.clone().add(way));
    if (a && b) line(a, b);
    byId("measured-box").hidden = !this.on;
    const said = byId("measured");
    if (!a || !b) replace(said, make("p", "hint", a ? texts.measure_second : texts.measure_first));
    else {
      const d = b.clone().sub(a);
      replace(
        said,
        facts([
          [texts.distance, metres(d.length())],
          ["dx", metres(d.x)],
          ["dy", metres(d.y)],
          ["dz", metres(d.z)],
        ]),
      );
    }
    this.changed();
  }
}
