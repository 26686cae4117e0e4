// SPDX-License-Identifier: Apache-2.0
// A section through the map: what stands higher than one level, and what lies before one vertical plane, is cut away.

import { Plane, Vector3 } from "three";
import { byId } from "./dom";
import { metres, texts } from "./settings";

type Axis = "z" | "y";
const STEP_M = 0.01;

export class Section {
  /** Kept: z below the level, y behind the plane. Shared by all materials that are cut. */
  readonly planes = [new Plane(new Vector3(0, 0, -1), Infinity), new Plane(new Vector3(0, 1, 0), Infinity)];
  private readonly at: Record<Axis, number | null> = { z: null, y: null };
  private readonly range: Record<Axis, [number, number]> = { z: [0, 0.5], y: [0, 1] };

  /** `changed` after each move of a slider. What a link says (?cut_z=0.5&cut_y=1.2, metres) is cut from the start. */
  constructor(private readonly changed: () => void) {
    const link = new URLSearchParams(location.search);
    for (const axis of ["z", "y"] as const) {
      const asked = link.get(`cut_${axis}`);
      if (asked !== null && asked !== "" && Number.isFinite(Number(asked))) this.at[axis] = Number(asked);
      byId(`cut-${axis}-label`).textContent = axis === "z" ? texts.cut_z : texts.cut_y;
      const slider = this.slider(axis);
      slider.step = String(STEP_M);
      slider.oninput = () => {
        const whole = this.end(axis);
        this.at[axis] = Math.abs(slider.valueAsNumber - whole) < STEP_M / 2 ? null : slider.valueAsNumber;
        this.apply();
        this.link(axis);
      };
    }
    this.apply();
  }

  /** How far the sliders go [m]: to the highest surface, and over all that was seen. */
  limits(top_m: number, low_y_m: number, high_y_m: number): void {
    const next: Record<Axis, [number, number]> = {
      z: [0, top_m],
      y: [Math.floor(low_y_m * 10) / 10, Math.ceil(high_y_m * 10) / 10],
    };
    if (JSON.stringify(next) === JSON.stringify(this.range)) return;
    Object.assign(this.range, next);
    this.apply();
  }

  /** Is a point shown? */
  keeps(p: Vector3): boolean {
    return (this.at.z === null || p.z <= this.at.z) && (this.at.y === null || p.y >= this.at.y);
  }

  private slider(axis: Axis): HTMLInputElement {
    return byId<HTMLInputElement>(`cut-${axis}`);
  }
  /** Where a slider stands when nothing is cut. */
  private end(axis: Axis): number {
    return axis === "z" ? this.range.z[1] : this.range.y[0];
  }
  private apply(): void {
    this.planes[0]!.constant = this.at.z ?? 1e6;
    this.planes[1]!.constant = -(this.at.y ?? -1e6);
    for (const axis of ["z", "y"] as const) {
      const slider = this.slider(axis);
      slider.min = String(this.range[axis][0]);
      slider.max = String(this.range[axis][1]);
      const at = this.at[axis];
      slider.value = String(at ?? this.end(axis));
      const said = at === null ? texts.cut_nothing : metres(at);
      byId(`cut-${axis}-at`).textContent = said;
      slider.setAttribute("aria-valuetext", said);
    }
    this.changed();
  }
  private link(axis: Axis): void {
    const url = new URL(window.location.href);
    const at = this.at[axis];
    if (at === null) url.searchParams.delete(`cut_${axis}`);
    else url.searchParams.set(`cut_${axis}`, at.toFixed(2));
    history.replaceState(null, "", url);
  }
}
