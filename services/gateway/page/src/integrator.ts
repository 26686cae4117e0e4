// SPDX-License-Identifier: Apache-2.0
// The integrator's view: the map in 3-D, and what the services measure.

import { Vector2, Vector3 } from "three";
import { byId, facts, make, replace } from "./dom";
import { Measure } from "./measure";
import { pick, type Picked } from "./pick";
import { View3d } from "./scene";
import { Section } from "./section";
import { applySettings, metres, seconds, tenths, texts, whole } from "./settings";
import type { State } from "./state";
import { whyMapInvalid } from "./statement";
import { Stream } from "./stream";
import { Surface as HeightSurface, type ColourBy } from "./surface";
import { EDGE, Surface, TileStore } from "./tiles";
import { Voxels } from "./voxels";

applySettings();
for (const [id, text] of [
  ["advisory", texts.advisory],
  ["to-operator", texts.operator],
  ["cursor-title", texts.cursor],
  ["downloads-title", texts.downloads],
  ["latencies-title", texts.latencies],
  ["drops-title", texts.drops],
  ["figures-title", texts.figures],
  ["colour-label", texts.colour_by],
  ["surface-label", texts.surface_view],
  ["voxels-label", texts.voxels_view],
  ["reset", texts.reset_view],
] as const)
  byId(id).textContent = text;
for (const [value, text] of [
  ["height", texts.by_height],
  ["age", texts.by_age],
  ["views", texts.by_views],
] as const)
  byId("colour").append(new Option(text, value));
for (const file of ["map.bt", "map.ot", "map.pcd", "map.ply", "heights.png", "heights.pgw", "heights.csv", "heights.json", "openapi.json"]) {
  const link = make("a", "", file) as HTMLAnchorElement;
  link.href = `/api/v1/${file}`;
  byId("downloads").append(link);
}

const store = new TileStore();
let view: View3d | null = null;
const section = new Section(() => {
  if (view) view.dirty = true;
});
const surface = new HeightSurface(store, section.planes);
const voxels = new Voxels(section.planes);
let state: State | null = null;
byId("scene").setAttribute("aria-label", texts.scene);

function open(): View3d | null {
  try {
    const made = new View3d(byId<HTMLCanvasElement>("scene"));
    made.scene.add(surface.group, voxels.group);
    return made;
  } catch {
    byId("voxels-said").textContent = texts.no_webgl;
    return null;
  }
}
view = open();

const stream = new Stream({
  state(next) {
    state = next;
    byId("crane").textContent = texts.crane(next.crane);
    if (store.begin(next.generation)) surface.clear();
    view?.show(next);
    showTables(next);
  },
  tiles(message) {
    if (store.put(message)) surface.clear();
    surface.changed(message.tiles);
    const rows = [...store.tiles.values()].map((tile) => tile.y * EDGE * (state?.map.voxel_m ?? 0));
    if (state && rows.length > 0)
      section.limits(surface.top_m, Math.min(...rows), Math.max(...rows) + EDGE * state.map.voxel_m);
    if (view && !view.touched) fit();
  },
});

/** All that was ever seen. */
function fit(): void {
  const voxel = state?.map.voxel_m ?? 0;
  const low = new Vector2(Infinity, Infinity);
  const high = new Vector2(-Infinity, -Infinity);
  for (const tile of store.tiles.values())
    tile.flags.forEach((flags, i) => {
      if (flags === 0) return;
      const at = new Vector2(tile.x * EDGE + (i % EDGE), tile.y * EDGE + Math.floor(i / EDGE));
      low.min(at);
      high.max(at);
    });
  if (!view || voxel === 0 || high.x < low.x) return;
  view.fit(low.multiplyScalar(voxel), high.multiplyScalar(voxel));
}

// ---------------------------------------------------------------- figures

function table(id: string, head: string[], rows: (string | number)[][]): void {
  const row = (cells: (string | number)[], tag: string) =>
    make("tr", "", ...cells.map((cell, i) => make(tag, i >= head.length - (head.length > 3 ? 3 : 1) ? "figure" : "", String(cell))));
  replace(byId(id), row(head, "th"), ...rows.map((cells) => row(cells, "td")));
}

function showTables(s: State): void {
  const name = (service: string) => texts.names[service] ?? service;
  table(
    "latencies",
    ["", texts.stage, "p50", "p99", "max"],
    s.services.flatMap((v) =>
      v.stages.map((t) => [name(v.service), t.stage, tenths(t.p50_ms), tenths(t.p99_ms), tenths(t.max_ms)]),
    ),
  );
  table(
    "drops",
    ["", "", ""],
    s.services.flatMap((v) => v.dropped.map((d) => [name(v.service), d.cause, whole(d.count)])),
  );
  table(
    "figures",
    ["", "", "±"],
    s.services.flatMap((v) => v.figures.map((f) => [f.name, f.value.toPrecision(3), f.sigma.toPrecision(2)])),
  );
}

function refresh(): void {
  const lost = stream.lost();
  byId("link").textContent = lost ? texts.link_lost : texts.link_ok;
  byId("link").classList.toggle("abnormal", lost);
  document.body.classList.toggle("gateway-lost", lost);
  byId("lost").hidden = !lost;
  byId("lost").textContent = Number.isFinite(stream.silence_s())
    ? texts.lost(seconds(Math.floor(stream.silence_s())))
    : texts.lost_never;
  const invalid = !lost && state !== null && !state.map.valid;
  const validity = byId("validity");
  validity.textContent = invalid ? `${texts.invalid_word}: ${whyMapInvalid(state!.map)}` : "";
  validity.className = invalid ? "link abnormal" : "";
}

// ---------------------------------------------------------------- the cursor

/** The column below a pixel, of what the section leaves. */
function below(x: number, y: number): Picked | null {
  if (!view || !state) return null;
  const { from, way } = view.ray(x, y);
  return pick(store, state.map.voxel_m, from, way, (p) => section.keeps(p));
}

function readCursor(x: number, y: number): void {
  if (!view || !state) return;
  const picked = below(x, y);
  if (!picked) return replace(byId("cursor"), make("p", "hint", texts.cursor_none));
  const { tile, index } = picked;
  const flags = tile.flags[index]!;
  const height = metres(tile.height_m[index]!);
  const bound = (flags & 4) !== 0;
  replace(
    byId("cursor"),
    facts([
      ["x, y", `${metres(picked.x)}, ${metres(picked.y)}`],
      [texts.height, bound ? texts.at_least(height) : height],
      ["", texts.surface[(flags & 3) === Surface.floor ? "floor" : "obstacle"]],
      [texts.views, whole(tile.views[index]!)],
      [texts.seen, texts.ago(seconds(state.time_ms / 1000 - tile.seen_s[index]!))],
    ]),
  );
}

const canvas = byId<HTMLCanvasElement>("scene");
const measure = new Measure(
  canvas,
  (x, y) => {
    const at = below(x, y);
    return at && new Vector3(at.x, at.y, at.tile.height_m[at.index]!);
  },
  () => {
    if (view) view.dirty = true;
  },
);
view?.scene.add(measure.group);
canvas.addEventListener("pointermove", (e) => readCursor(e.offsetX, e.offsetY));
byId<HTMLSelectElement>("colour").onchange = (e) => {
  surface.colourBy = (e.target as HTMLSelectElement).value as ColourBy;
  surface.all();
};
byId<HTMLInputElement>("surface").onchange = (e) => {
  surface.group.visible = (e.target as HTMLInputElement).checked;
  if (view) view.dirty = true;
};
byId<HTMLInputElement>("voxels").onchange = async (e) => {
  const said = byId("voxels-said");
  voxels.group.visible = (e.target as HTMLInputElement).checked;
  if (view) view.dirty = true;
  said.textContent = "";
  if (!voxels.group.visible || !state) return;
  said.textContent = texts.voxels_loading;
  try {
    const revision = state.map.revision;
    said.textContent = texts.voxels_of(await voxels.fetch(state.map.voxel_m, surface.top_m), revision);
  } catch (why) {
    said.textContent = texts.voxels_failed(why instanceof Error ? why.message : String(why));
  }
  if (view) view.dirty = true;
};
byId("reset").onclick = () => {
  if (view) view.touched = false;
  fit();
};

function draw(): void {
  requestAnimationFrame(draw);
  if (!view) return;
  if (state && surface.update(state.map.voxel_m, state.time_ms)) view.dirty = true;
  view.draw();
}
replace(byId("cursor"), make("p", "hint", texts.cursor_none));
refresh();
draw();
setInterval(refresh, 250);
