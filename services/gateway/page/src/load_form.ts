// SPDX-License-Identifier: Apache-2.0
// What hangs on the hook: as the crane's controller tells it, else as it was entered here.

import type { Hoist, Query } from "./state";
import { make } from "./dom";
import { texts } from "./settings";

const STORE = "load";

const FIELDS = [
  ["size_x_m", texts.size_x, 0.5],
  ["size_y_m", texts.size_y, 0.5],
  ["size_z_m", texts.size_z, 0.5],
  ["z_m", texts.z, 1],
  ["margin_m", texts.margin, 0.2],
  ["above_m", texts.above, null],
] as const;
type Name = (typeof FIELDS)[number][0];

export class LoadForm {
  private readonly inputs = new Map<Name, HTMLInputElement>();
  private readonly note: HTMLElement;
  private told: Hoist | null = null;

  constructor(place: HTMLElement, changed: () => void) {
    const kept = JSON.parse(localStorage.getItem(STORE) ?? "{}") as Partial<Record<Name, number | null>>;
    for (const [name, label, usual] of FIELDS) {
      const input = document.createElement("input");
      input.type = "number";
      input.name = name;
      input.min = "0";
      input.max = "50";
      input.step = "0.05";
      const value = kept[name] ?? usual;
      input.value = value === null ? "" : String(value);
      if (name === "above_m") input.placeholder = texts.above_hint;
      input.oninput = () => {
        localStorage.setItem(STORE, JSON.stringify(Object.fromEntries(FIELDS.map(([n]) => [n, this.value(n)]))));
        changed();
      };
      this.inputs.set(name, input);
      place.append(make("label", "", make("span", "", label), input, make("span", "unit", "m")));
    }
    this.note = make("p", "note", texts.load_entered);
    place.append(this.note);
    place.onsubmit = (event) => event.preventDefault();
  }

  tell(hoist: Hoist | null): void {
    const told = hoist?.ok ? hoist : null;
    this.told = told;
    const note = told ? texts.load_told : texts.load_entered;
    if (this.note.textContent !== note) this.note.textContent = note;
    const { size, z_m } = this.now();
    const shown: Partial<Record<Name, number>> = { size_x_m: size[0], size_y_m: size[1], size_z_m: size[2], z_m };
    for (const [name, input] of this.inputs) {
      const fixed = told !== null && name in shown;
      input.disabled = fixed;
      if (fixed) input.value = shown[name]!.toFixed(2);
    }
  }

  /** Underside of the load, or of the hook without one, size and turn. */
  now(): { size: [number, number, number]; z_m: number; yaw_rad: number; told: boolean } {
    const t = this.told;
    if (t)
      return {
        size: t.load_size_m,
        z_m: Math.max(0, t.hook_height_m - (t.load_size_m[2] > 0 ? t.sling_m + t.load_size_m[2] : 0)),
        yaw_rad: t.load_yaw_rad,
        told: true,
      };
    return {
      size: [this.value("size_x_m") ?? 0, this.value("size_y_m") ?? 0, this.value("size_z_m") ?? 0],
      z_m: this.value("z_m") ?? 0,
      yaw_rad: 0,
      told: false,
    };
  }

  query(points: { x: number; y: number }[]): Query {
    const { size, z_m, yaw_rad } = this.now();
    const above = this.value("above_m");
    return {
      path: points.map((p) => ({ x_m: p.x, y_m: p.y, z_m, yaw_rad })),
      load: { size_x_m: size[0], size_y_m: size[1], size_z_m: size[2], above_m: above ?? -1 },
      margins: { horizontal_m: this.value("margin_m") ?? 0.2, vertical_m: 0.1 },
    };
  }

  /** Metres; null where nothing is entered. */
  private value(name: Name): number | null {
    const v = this.inputs.get(name)!.valueAsNumber;
    return Number.isFinite(v) ? Math.min(50, Math.max(0, v)) : null;
  }
}
