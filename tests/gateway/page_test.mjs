// SPDX-License-Identifier: Apache-2.0
// The page in a real browser, before real services and a real map.
// usage: node page_test.mjs PROGRAMS RECORDING OUT    pictures and logs go to OUT

import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { mkdirSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { setTimeout as sleep } from "node:timers/promises";
import axe from "axe-core";
import { chromium } from "playwright-core";
import { Crane, eventually } from "./services.mjs";

const [bin, recording, out] = process.argv.slice(2);
mkdirSync(out, { recursive: true });
const crane = new Crane(bin, recording, join(out, "logs"));
const complaints = []; // of the page: there must be none

async function step(name, run) {
  const begin = Date.now();
  const figure = await run();
  console.log(`ok  ${name}${figure === undefined ? "" : `: ${figure}`}  (${Date.now() - begin} ms)`);
}

function listen(page) {
  page.on("console", (m) => m.type() === "error" && complaints.push(m.text()));
  page.on("pageerror", (e) => complaints.push(String(e)));
  page.on("request", (r) => new URL(r.url()).hostname === "127.0.0.1" || complaints.push(`asks ${r.url()}`));
}

/** What axe finds against WCAG 2.1 A and AA: there must be nothing. */
async function accessible(page) {
  const found = await page.evaluate(async (source) => {
    (0, eval)(source);
    const { violations } = await window.axe.run(document, { runOnly: ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa"] });
    return violations.flatMap((v) => v.nodes.map((n) => `${v.id}: ${n.html.slice(0, 160)}: ${n.failureSummary}`));
  }, axe.source);
  assert.deepEqual(found, [], page.url());
}

/** The figure behind a name in a list of facts, metres. */
async function fact(page, list, name) {
  const text = await page.locator(`${list} dt`, { hasText: new RegExp(`^${name}$`) }).locator("+ dd").first().textContent();
  return text.replace(/ m$/, "").replace("at least ", "").split(", ").map((v) => Number.parseFloat(v));
}

const verdict = (page) => page.getAttribute("#statement", "data-verdict");
/** Where the view puts metres on the canvas: as the page reads them back. */
async function pixelOf(page, x, y) {
  const box = await page.locator("#picture").boundingBox();
  const at = async (px, py) => {
    await page.mouse.click(box.x + px, box.y + py);
    await page.waitForFunction((old) => new URLSearchParams(location.search).get("at") !== old, await page.evaluate(() => window.last));
    const read = new URLSearchParams(await page.evaluate(() => location.search)).get("at");
    await page.evaluate((r) => (window.last = r), read);
    return read.split(",").map(Number);
  };
  const [ax, ay] = await at(box.width * 0.3, box.height * 0.3);
  const [bx, by] = await at(box.width * 0.6, box.height * 0.7);
  return {
    x: box.x + box.width * 0.3 + ((x - ax) * box.width * 0.3) / (bx - ax),
    y: box.y + box.height * 0.3 + ((y - ay) * box.height * 0.4) / (by - ay),
  };
}

/** Where a load of 0.2 m at 0.2 m is clear for 0.3 m along x, with more room than the page will ask for. */
async function openPlace(url) {
  for (let y_m = 0; y_m < 2; y_m += 0.1)
    for (let x_m = 0; x_m < 2.6; x_m += 0.1) {
      const body = {
        path: [{ x_m, y_m, z_m: 0.2 }, { x_m: x_m + 0.3, y_m, z_m: 0.2 }],
        load: { size_x_m: 0.2, size_y_m: 0.2, size_z_m: 0.2, above_m: 0.1 },
        margins: { horizontal_m: 0.12, vertical_m: 0.1 },
      };
      const response = await fetch(`${url}/api/v1/clearance`, {
        method: "POST",
        headers: { "Content-Type": "application/json" },
        body: JSON.stringify(body),
      });
      if ((await response.json()).verdict === "clear") return { x_m, y_m };
    }
  throw new Error("nowhere is anything clear");
}

let browser;
try {
  crane.startAll();
  const url = await crane.url();
  await step("the map of a whole lap arrives at the gateway", () =>
    eventually("valid map", async () => {
      const s = await crane.status(url).catch(() => null);
      return s?.map?.valid && s.map.tiles >= 6 && s.map.revision > 60 ? `revision ${s.map.revision}` : null;
    }),
  );

  browser = await chromium.launch({
    executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
    args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
  });
  const context = await browser.newContext({ viewport: { width: 1600, height: 900 }, locale: "en-GB" });
  const page = await context.newPage();
  listen(page);
  const shoot = async (name, where = page) => {
    await sleep(400);
    await where.screenshot({ path: join(out, `${name}.png`) });
  };

  await step("the page stands, and says it is advisory", async () => {
    const begin = Date.now();
    await page.goto(`${url}/?theme=light&lang=en`);
    await page.locator("#legend canvas").first().waitFor();
    const took = Date.now() - begin;
    assert.match(await page.textContent("#advisory"), /Advisory only/);
    return `first heights after ${took} ms`;
  });

  await step("where the crane is, the load as entered is asked for", () =>
    eventually("a verdict", async () => ["clear", "blocked"].includes(await verdict(page))),
  );
  await shoot("operator-light");

  await step("a path drawn over the map gets the client library's answer", async () => {
    const verdicts = new Set();
    const place = await openPlace(url);
    const from = await pixelOf(page, place.x_m, place.y_m);
    const to = await pixelOf(page, place.x_m + 0.3, place.y_m);
    const entered = { size_x_m: 0.2, size_y_m: 0.2, size_z_m: 0.2, margin_m: 0.05, above_m: 0.1 };
    for (const [name, value] of Object.entries(entered)) await page.fill(`[name=${name}]`, String(value));
    for (const z of [0.05, 0.2]) {
      await page.fill("[name=z_m]", String(z));
      await page.click("#draw");
      await page.mouse.move(from.x, from.y);
      await page.mouse.down();
      await page.mouse.move((from.x + to.x) / 2, from.y, { steps: 10 });
      await page.mouse.move(to.x, to.y, { steps: 10 });
      const asked = page.waitForResponse((r) => r.url().endsWith("/clearance") && r.request().postDataJSON().path.length > 1);
      await page.mouse.up();
      const response = await asked;
      const q = response.request().postDataJSON();
      const a = await response.json();
      const said = crane.query(
        "--path", ...q.path.map((p) => `${p.x_m},${p.y_m},${p.z_m}`),
        "--load", ...["size_x_m", "size_y_m", "size_z_m"].map((k) => String(q.load[k])),
        "--above", String(q.load.above_m),
        "--margin", String(q.margins.horizontal_m), String(q.margins.vertical_m),
      );
      assert.equal({ clear: 0, blocked: 1 }[a.verdict], said.code, said.text + JSON.stringify(a));
      console.log(`    at ${z} m ${a.verdict}, ${a.text}`);
      await eventually("the statement says it", async () => (await verdict(page)) === a.verdict, 10);
      if (a.safe_height_m !== null)
        assert.match(await page.textContent("#statement"), new RegExp(`${a.safe_height_m.toFixed(2)} m`));
      verdicts.add(a.verdict);
      await shoot(`operator-path-${a.verdict}`);
    }
    assert.equal(verdicts.size, 2, "5 cm above the floor, with a margin of 10 cm, is blocked; 20 cm is clear");
  });

  await step("the mapper is silent: invalid; it speaks again: not", async () => {
    crane.signal("mapper", "SIGSTOP");
    const begin = Date.now();
    await eventually("invalid", async () => (await verdict(page)) === "invalid", 10);
    const took = Date.now() - begin;
    assert.match(await page.textContent("#statement"), /the mapper is silent/);
    await shoot("operator-invalid");
    crane.signal("mapper", "SIGCONT");
    await eventually("valid again", async () => (await verdict(page)) !== "invalid", 30);
    return `said after ${took} ms`;
  });

  await step("a mapper that was stopped and started again: another map, and the page goes on", async () => {
    const before = (await crane.status(url)).map.map_id;
    await crane.restart("mapper");
    await eventually("another map", async () => {
      const s = await crane.status(url);
      return s.map.valid && s.map.map_id !== before;
    });
    await eventually("a verdict", async () => ["clear", "blocked"].includes(await verdict(page)), 30);
  });

  await step("the gateway is lost: the page says so, and comes back", async () => {
    crane.signal("gateway", "SIGSTOP");
    await eventually("lost", async () => (await verdict(page)) === "invalid" && (await page.isVisible("#lost")), 10);
    await shoot("operator-lost");
    crane.signal("gateway", "SIGCONT");
    await eventually("back", async () => (await verdict(page)) !== "invalid" && !(await page.isVisible("#lost")), 30);
  });

  await page.keyboard.press("Escape");
  await step("dark, and in German", async () => {
    await page.goto(`${url}/?theme=dark&lang=de`);
    await eventually("a verdict", async () => ["clear", "blocked"].includes(await verdict(page)), 30);
    assert.match(await page.textContent("#advisory"), /Nur Hinweis/);
    await shoot("operator-dark-de");
    await page.setViewportSize({ width: 820, height: 1180 });
    await shoot("operator-tablet");
    await page.setViewportSize({ width: 1600, height: 900 });
    await page.goto(`${url}/?theme=light&lang=en`);
  });

  await step("the integrator's view shows surface and voxels, and reads what is below the cursor", async () => {
    for (const theme of ["dark", "light"]) {
      await page.goto(`${url}/integrator.html?theme=${theme}&lang=en`);
      await page.locator("#latencies td").first().waitFor();
      await sleep(1500);
      const box = await page.locator("#scene").boundingBox();
      await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
      await eventually("a height", async () => /\d m/.test(await page.textContent("#cursor")), 30);
      await shoot(`integrator-${theme}`);
    }
    await page.uncheck("#surface");
    await page.check("#voxels");
    await eventually("voxels", async () => /^[1-9]\d* voxels/.test((await page.textContent("#voxels-said")).replace(/,/g, "")), 30);
    await shoot("integrator-voxels");
    await page.goto(`${url}/?theme=light&lang=en`);
  });

  await step("a section cuts surface and cursor away, and a link says it", async () => {
    await page.goto(`${url}/integrator.html?theme=light&lang=en`);
    await page.locator("#latencies td").first().waitFor();
    await eventually("a surface to cut", async () => Number(await page.getAttribute("#cut-y", "max")) > 1.5, 30);
    const box = await page.locator("#scene").boundingBox();
    const read = async () => {
      await page.mouse.move(box.x + box.width / 2 + 3, box.y + box.height / 2);
      await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
      return page.textContent("#cursor");
    };
    await eventually("a height", async () => /\d m/.test(await read()), 30);
    await page.locator("#cut-z").fill("0.3");
    await page.locator("#cut-y").fill("0.8");
    await shoot("integrator-section");
    const linked = await page.evaluate(() => location.search);
    assert.match(linked, /cut_z=0\.30/);
    assert.match(linked, /cut_y=0\.80/);
    await page.reload();
    await eventually("cut as linked", async () => (await page.textContent("#cut-z-at")) === "0.30 m", 10);
    await page.locator("#cut-y").fill(await page.getAttribute("#cut-y", "max"));
    assert.equal(await read(), "nothing under the cursor");
    await page.locator("#cut-y").fill(await page.getAttribute("#cut-y", "min"));
    assert.equal(await page.textContent("#cut-y-at"), "nothing");
    await eventually("a height again", async () => /\d m/.test(await read()), 30);
  });

  await step("two clicks measure what the cursor reads there", async () => {
    await page.goto(`${url}/integrator.html?theme=dark&lang=en`);
    await page.locator("#latencies td").first().waitFor();
    await sleep(1500);
    await page.keyboard.press("m");
    const box = await page.locator("#scene").boundingBox();
    const ends = [];
    for (const [u, v] of [[0.45, 0.55], [0.58, 0.42]]) {
      await page.mouse.move(box.x + u * box.width, box.y + v * box.height);
      await page.mouse.click(box.x + u * box.width, box.y + v * box.height);
      ends.push([...(await fact(page, "#cursor", "x, y")), ...(await fact(page, "#cursor", "Height"))]);
    }
    const told = [];
    for (const name of ["dx", "dy", "dz", "Distance"]) told.push(...(await fact(page, "#measured", name)));
    for (let k = 0; k < 3; k++) assert.ok(Math.abs(told[k] - (ends[1][k] - ends[0][k])) < 0.05, `${told} of ${ends}`);
    assert.ok(Math.abs(told[3] - Math.hypot(told[0], told[1], told[2])) < 0.02, String(told));
    await shoot("integrator-measured");
    await page.keyboard.press("Escape");
    assert.equal(await page.isVisible("#measured-box"), false);
    return `${told[3]} m`;
  });

  await step("nothing against WCAG AA: both views, both themes, and on a tablet", async () => {
    for (const theme of ["light", "dark"])
      for (const [name, ready] of [["", "#health td"], ["integrator.html", "#latencies td"]])
        for (const [width, height] of [[1600, 900], [1024, 768], [768, 1024]]) {
          await page.setViewportSize({ width, height });
          await page.goto(`${url}/${name}?theme=${theme}&lang=en`);
          await page.locator(ready).first().waitFor();
          await sleep(300);
          await accessible(page);
          if (width < 1600) await shoot(`${name === "" ? "operator" : "integrator"}-${width}-${theme}`);
        }
    await page.setViewportSize({ width: 1600, height: 900 });
    await page.goto(`${url}/?theme=light&lang=en`);
  });

  await step("downloads are whole, and OctoMap reads its own", async () => {
    await eventually("a complete map", async () => {
      for (const kind of ["bt", "ot", "pcd", "ply"]) {
        const file = await fetch(`${url}/api/v1/map.${kind}`);
        if (!file.ok) return false; // between two frames
        writeFileSync(join(out, `map.${kind}`), Buffer.from(await file.arrayBuffer()));
      }
      return true;
    });
    for (const kind of ["bt", "ot"]) {
      const judged = spawnSync(join(bin, "cranemap"), ["evaluate", join(out, `map.${kind}`), join(recording, "truth")], { encoding: "utf8" });
      assert.equal(judged.status, 0, judged.stdout + judged.stderr);
    }
    const grid = await (await fetch(`${url}/api/v1/heights`)).json();
    assert.equal(grid.height_m.length, grid.columns * grid.rows);
    assert.equal(Buffer.from(await (await fetch(`${url}/api/v1/heights.png`)).arrayBuffer()).readUInt32BE(16), grid.columns);
    const world = (await (await fetch(`${url}/api/v1/heights.pgw`)).text()).trim().split("\n").map(Number);
    assert.ok(Math.abs(world[5] - (grid.origin_y_m + (grid.rows - 0.5) * grid.cell_m)) < 1e-5);
    const openapi = await (await fetch(`${url}/api/v1/openapi.json`)).json();
    for (const path of Object.keys(openapi.paths))
      assert.notEqual((await fetch(`${url}/api/v1${path}`)).status, 404, path);
  });

  await step("no camera: an alarm; acknowledged it stays so after a reload; a click shows the library's height", async () => {
    crane.signal("camera", "SIGSTOP");
    await eventually("invalid", async () => (await verdict(page)) === "invalid", 30);
    await page.locator("#alarms .fresh button").first().click();
    await page.locator("#alarms .known").first().waitFor();
    await page.reload();
    await page.locator("#alarms .known").first().waitFor();
    // Once the map rests what is clicked is what a client holds.
    const resting = { revision: -1, since: 0 };
    await eventually("no more changes", async () => {
      const { revision } = (await crane.status(url)).map;
      if (revision !== resting.revision) Object.assign(resting, { revision, since: Date.now() });
      return Date.now() - resting.since > 2000;
    });
    for (const [x, y] of [[1.225, 0.925], [0.775, 0.575], [1.725, 1.825], [2.025, 1.225], [5.025, 5.025]]) {
      const at = await pixelOf(page, x, y);
      await page.mouse.click(at.x, at.y);
      await sleep(500);
      const [cx, cy] = new URLSearchParams(await page.evaluate(() => location.search)).get("at").split(",");
      const said = crane.query("--at", cx, cy).text;
      const shown = await page.textContent("#column");
      const height = said.match(/\): (at least )?(-?[\d.]+) m/);
      if (height) {
        assert.ok(shown.includes(`${Number(height[2]).toFixed(2)} m`), `${said}\n${shown}`);
        assert.equal(shown.includes("at least"), height[1] !== undefined, `${said}\n${shown}`);
      } else {
        assert.match(said, /so not free/);
        assert.match(shown, /Unknown is not free/);
      }
    }
    await shoot("operator-alarm");
    crane.signal("camera", "SIGCONT");
    await eventually("a verdict", async () => ["clear", "blocked"].includes(await verdict(page)), 30);
    await eventually("no alarm", async () => (await page.locator("#alarms .none").count()) === 1, 30);
  });

  assert.deepEqual(complaints.filter((c) => !/WebSocket|ERR_|503|Failed to load resource/.test(c)), [], "the page complained");
  console.log("all passed");
} finally {
  await browser?.close();
  await crane.stopAll();
}
