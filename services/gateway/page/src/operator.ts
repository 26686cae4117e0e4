// SPDX-License-Identifier: Apache-2.0
// The operator's view.

import type { ColumnHeight, State } from "./state";
import { Alarms, alarmsOf } from "./alarms";
import { askClearance, askHeight } from "./api";
import { byId, facts, make, replace } from "./dom";
import { Gestures } from "./gestures";
import { Health } from "./health";
import { drawLegend } from "./legend";
import { LoadForm } from "./load_form";
import { lengthOf, simplified } from "./path";
import { Picture } from "./picture";
import { applySettings, linkColumn, linkedColumn, metres, seconds, texts, whole } from "./settings";
import { showStatement, verdictNow, type Answered, type Asked } from "./statement";
import { Stream } from "./stream";
import { TileStore } from "./tiles";
import type { Point } from "./view";

/** Again so often; what has not changed is asked again more rarely. */
const ASK_EVERY_MS = 500;
const SAME_AGAIN_MS = 1000;

applySettings();
byId("picture").setAttribute("aria-label", texts.picture);
byId("advisory").textContent = texts.advisory;
byId("to-integrator").textContent = texts.integrator;
byId("column-title").textContent = texts.column;
byId("load-title").textContent = texts.load;
byId("alarms-title").textContent = texts.alarms;
byId("health-title").textContent = texts.health;
byId("clear").textContent = texts.clear;
byId("fit").textContent = texts.fit;

const picture = new Picture(byId<HTMLCanvasElement>("picture"));
const store = new TileStore();
const alarms = new Alarms(byId("alarms"));
const health = new Health(byId("health"));
const load = new LoadForm(byId("load"), askAnew);
let state: State | null = null;
let wholeAt = -Infinity;
let path: Point[] = []; // being drawn, or drawn
let drawing = false; // the finger is down
let answered: Answered | null = null;
let number = 0; // of the question
let column: Point | null = linkedColumn();
let dirty = true;

// ---------------------------------------------------------------- what is told

const stream = new Stream({
  state(next) {
    state = next;
    if (next.map.complete) wholeAt = performance.now();
    if (store.begin(next.generation)) picture.layers.rebuild(store);
    load.tell(next.hoist);
    health.show(next);
    byId("crane").textContent = texts.crane(next.crane);
    refresh();
  },
  tiles(message) {
    if (store.put(message)) picture.layers.rebuild(store);
    picture.layers.add(message.tiles, store);
    drawLegend(byId("legend"), picture.layers);
    if (!touched) fit();
    dirty = true;
  },
});

// ---------------------------------------------------------------- what is asked

/** Where the load hangs when the crane is at rest there. */
function hangsAt(): Point | null {
  if (!state?.position) return null;
  const [ox, oy] = state.hoist?.offset_m ?? [0, 0];
  const [sx, sy] = state.hoist?.sway_m ?? [0, 0];
  return { x: state.position.x_m + ox + sx, y: state.position.y_m + oy + sy };
}

function question(): Asked | null {
  if (path.length > 1 && !drawing)
    return { kind: "path", query: load.query(path), length_m: lengthOf(path), number };
  const at = hangsAt();
  if (!at) return null;
  return { kind: load.now().told ? "load" : "entered", query: load.query([at]), length_m: 0, number };
}

/** What was answered before is no answer to this. */
function askAnew(): void {
  number++;
  void ask();
}

function holdsStill(asked: Asked): boolean {
  if (!answered || performance.now() - answered.at_ms > SAME_AGAIN_MS) return false;
  return JSON.stringify(asked) === JSON.stringify(answered.asked);
}

let asking = false;
let again = false;
async function ask(): Promise<void> {
  const asked = question();
  if (asking) {
    again = true;
    return;
  }
  if (!asked || stream.lost() || holdsStill(asked)) return refresh();
  asking = true;
  try {
    answered = { asked, answer: await askClearance(asked.query), at_ms: performance.now() };
  } catch {
    // The statement says that there is none as soon as the last one holds no longer.
  }
  asking = false;
  refresh();
  if (again) {
    again = false;
    void ask();
  }
}

/** To the millimetre, as the link says it. */
function choose(p: Point): void {
  column = { x: Math.round(1000 * p.x) / 1000, y: Math.round(1000 * p.y) / 1000 };
  linkColumn(column.x, column.y);
  void readColumn();
}

async function readColumn(): Promise<void> {
  const asked = column;
  if (!asked) return;
  dirty = true;
  try {
    const height = await askHeight(asked.x, asked.y);
    if (asked === column) showColumn(height);
  } catch {
    if (asked === column) replace(byId("column"), make("p", "", texts.no_answer));
  }
}

function showColumn(h: ColumnHeight): void {
  const known = h.height_m !== null;
  const rows: [string, string][] = [["x, y", `${metres(h.x_m)}, ${metres(h.y_m)}`]];
  if (known) {
    const height = metres(h.height_m!);
    rows.unshift([texts.height, h.lower_bound ? texts.at_least(height) : height]);
    if (!h.lower_bound) rows.push([texts.free_to, metres(h.free_to_m!)]);
    rows.push([texts.views, h.views >= 32 ? "≥ 32" : whole(h.views)]);
  }
  rows.push([texts.seen, h.age_s === null ? texts.surface.unknown : texts.ago(seconds(h.age_s))]);
  const parts: Node[] = [make("p", "surface", texts.surface[h.surface])];
  if (!known) parts.push(make("p", "why", texts.not_free));
  if (known && h.lower_bound) parts.push(make("p", "why", texts.lower_bound));
  replace(byId("column"), ...parts, facts(rows));
}

// ---------------------------------------------------------------- what is shown

function refresh(): void {
  const lost = stream.lost();
  const asked = question();
  const now = verdictNow(lost, state, wholeAt, asked, answered, performance.now());
  showStatement(byId("statement"), now, lost ? null : state, asked, answered);
  alarms.show(alarmsOf(lost, state), !lost);
  const link = byId("link");
  link.textContent = lost ? texts.link_lost : texts.link_ok;
  link.classList.toggle("abnormal", lost);
  document.body.classList.toggle("gateway-lost", lost);
  const silence = stream.silence_s();
  const notice = byId("lost");
  notice.hidden = !lost;
  notice.textContent = Number.isFinite(silence) ? texts.lost(seconds(Math.floor(silence))) : texts.lost_never;
  dirty = true;
}

function draw(): void {
  requestAnimationFrame(draw);
  if (picture.resize()) {
    if (!touched) fit();
    dirty = true;
  }
  if (!dirty) return;
  dirty = false;
  const asked = question();
  const at = hangsAt();
  const { size, yaw_rad } = load.now();
  const fresh = answered !== null && asked?.number === answered.asked.number && !stream.lost();
  picture.draw({
    state: stream.lost() ? state && { ...state, position: null, footprint: [] } : state,
    path,
    swept_m: Math.hypot(size[0], size[1]) + 2 * load.query([]).margins.horizontal_m,
    answer: fresh && state?.map.valid ? answered!.answer : null,
    load: at && !stream.lost() ? { ...at, size_x_m: size[0], size_y_m: size[1], yaw_rad } : null,
    column,
  });
}

let touched = false; // the user chose what is to be seen
function fit(): void {
  if (!state || picture.layers.empty) return;
  picture.fit(state.map.voxel_m);
  dirty = true;
}

// ---------------------------------------------------------------- what is done

const drawButton = byId<HTMLButtonElement>("draw");
function setDrawing(on: boolean): void {
  gestures.drawing = on;
  drawButton.setAttribute("aria-pressed", String(on));
  drawButton.textContent = on ? texts.draw_now : texts.draw;
  picture.canvas.classList.toggle("drawing", on);
}

function clearPath(): void {
  path = [];
  drawing = false;
  setDrawing(false);
  askAnew();
}

const gestures = new Gestures(picture.canvas, picture.view, {
  moved() {
    touched = true;
    dirty = true;
  },
  tapped: choose,
  drawn(points, done) {
    touched = true; // nothing moves below the finger
    drawing = !done;
    path = done ? simplified(points) : points;
    dirty = true;
    if (!done) return;
    setDrawing(false);
    askAnew();
  },
});

drawButton.onclick = () => setDrawing(!gestures.drawing);
byId("clear").onclick = clearPath;
byId("fit").onclick = () => {
  touched = false;
  fit();
};
addEventListener("keydown", (event) => {
  if (event.target instanceof HTMLInputElement) return;
  if (event.key === "d") setDrawing(!gestures.drawing);
  else if (event.key === "Escape") clearPath();
  else if (event.key === "0") fit();
  else return;
  event.preventDefault();
});

setDrawing(false);
replace(byId("column"), make("p", "hint", texts.column_hint));
void readColumn();
refresh();
draw();
setInterval(refresh, 250);
setInterval(() => {
  if (document.hidden) return;
  void ask();
  void readColumn();
}, ASK_EVERY_MS);
