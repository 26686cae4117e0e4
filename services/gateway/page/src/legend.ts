// SPDX-License-Identifier: Apache-2.0
import { make } from "./dom";
import { grey, type Layers } from "./layers";
import { CROSS, DOTS, HATCH } from "./picture";
import { metres, texts, theme } from "./settings";

function swatch(fill: CanvasPattern): HTMLCanvasElement {
  const canvas = document.createElement("canvas");
  canvas.width = 34;
  canvas.height = 18;
  const c = canvas.getContext("2d")!;
  c.fillStyle = fill;
  c.fillRect(0, 0, 34, 18);
  return canvas;
}

function ramp(): HTMLCanvasElement {
  const canvas = document.createElement("canvas");
  canvas.width = 120;
  canvas.height = 18;
  const c = canvas.getContext("2d")!;
  for (let x = 0; x < 120; x++) {
    const g = grey(x / 119, theme === "dark");
    c.fillStyle = `rgb(${g},${g},${g})`;
    c.fillRect(x, 0, 1, 18);
  }
  return canvas;
}

let shownTop = NaN;

/** What greys and patterns mean. */
export function drawLegend(place: HTMLElement, layers: Layers): void {
  const left = layers.leftOut > 0 ? 1 : 0;
  if (layers.top_m + left * 1000 === shownTop) return;
  shownTop = layers.top_m + left * 1000;
  place.replaceChildren(
    make("span", "", metres(0)),
    make("span", "", ramp()),
    make("span", "", metres(layers.top_m)),
    make("span", "", swatch(HATCH), texts.legend_unknown),
    make("span", "", swatch(CROSS), texts.legend_stale),
    make("span", "", swatch(DOTS), texts.legend_bound),
    make("span", "sees", texts.legend_sees),
    ...(left ? [make("span", "abnormal", texts.left_out)] : []),
  );
}
