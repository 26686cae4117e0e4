// SPDX-License-Identifier: Apache-2.0
// Real services on a real recording, and what is asked of them by the client library's own command.

import { spawn, spawnSync } from "node:child_process";
import { closeSync, mkdirSync, openSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { setTimeout as sleep } from "node:timers/promises";

const SITE = (domain) => `dds: {domain: ${domain}}
http: {port: 0}
gateway: {port: 0}
zones:
  - {id: 1, name: press, kind: no-go, active: true, z_min_m: 0, z_max_m: 3, corners: [{x: 2.2, y: 0.4}, {x: 2.7, y: 0.4}, {x: 2.7, y: 0.9}, {x: 2.2, y: 0.9}]}
  - {id: 2, name: gate, kind: slow-down, active: true, switchable: true, z_min_m: 0, z_max_m: 3, corners: [{x: 0.2, y: 1.6}, {x: 0.8, y: 1.6}, {x: 0.8, y: 2.1}, {x: 0.2, y: 2.1}]}
`;

export async function eventually(what, condition, limit_s = 60) {
  const until = Date.now() + 1000 * limit_s;
  for (;;) {
    const value = await condition();
    if (value) return value;
    if (Date.now() > until) throw new Error(`not within ${limit_s} s: ${what}`);
    await sleep(50);
  }
}

export class Crane {
  processes = new Map();

  constructor(bin, recording, folder) {
    this.bin = bin;
    this.recording = recording;
    this.folder = folder;
    rmSync(folder, { recursive: true, force: true }); // logs of an earlier run name its ports
    mkdirSync(folder, { recursive: true });
    this.site = join(folder, "site.yaml");
    // Of the range that the other tests take; ctest runs none of them at the same time.
    writeFileSync(this.site, SITE(60 + (process.pid % 20)));
  }

  start(name, ...more) {
    const log = join(this.folder, `${name}.log`);
    const out = openSync(log, "a");
    const child = spawn(join(this.bin, `cranemap-${name}`), ["--config", this.site, ...more], {
      stdio: ["ignore", out, out],
    });
    closeSync(out);
    this.processes.set(name, { child, log, more });
    return child;
  }
  startAll() {
    this.start("mapper", "--calibration", this.recording);
    this.start("stereo", "--calibration", this.recording);
    const start = `${Date.now() + 2000}000000`; // in step, as if it were now
    for (const player of ["rangefinder", "camera"])
      this.start(player, this.recording, "--loop", "--stream", "7", "--start-at", start, "--stamps", "now");
    this.start("gateway", "--calibration", this.recording);
  }
  signal(name, signal) {
    this.processes.get(name).child.kill(signal);
  }
  async stop(name) {
    const { child } = this.processes.get(name);
    if (child.exitCode !== null || child.signalCode !== null) return;
    const ended = new Promise((done) => child.once("exit", done));
    child.kill("SIGCONT");
    child.kill("SIGTERM");
    const killer = setTimeout(() => child.kill("SIGKILL"), 8000);
    await ended;
    clearTimeout(killer);
  }
  async stopAll() {
    for (const name of [...this.processes.keys()].reverse()) await this.stop(name);
  }
  async restart(name) {
    await this.stop(name);
    this.start(name, ...this.processes.get(name).more);
  }

  /** Where the gateway serves, once it does. */
  async url() {
    const { log } = this.processes.get("gateway");
    return eventually("the gateway serves", () => {
      for (const [name, { child }] of this.processes)
        if (child.exitCode !== null) throw new Error(`cranemap-${name} ended: see ${this.folder}/${name}.log`);
      const said = readFileSync(log, "utf8").match(/page and API: (http:\/\/[^\s]+)\//);
      return said && said[1];
    });
  }
  async status(url) {
    return (await fetch(`${url}/api/v1/status`)).json();
  }

  /** `cranemap query`: what the client library answers. */
  query(...more) {
    const run = spawnSync(join(this.bin, "cranemap"), ["query", "--config", this.site, ...more], {
      encoding: "utf8",
      timeout: 30_000,
    });
    return { code: run.status, text: run.stdout + run.stderr };
  }
}
