// SPDX-License-Identifier: Apache-2.0
// Foxglove's protocol as its own client speaks it, before real services and a real map; messages
// against its own schemas.
// usage: node foxglove_test.mjs PROGRAMS RECORDING OUT    logs go to OUT

import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { randomBytes } from "node:crypto";
import { appendFileSync, mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { connect } from "node:net";
import { join } from "node:path";
import { setTimeout as sleep } from "node:timers/promises";
import protocol from "@foxglove/ws-protocol";
import * as schemas from "@foxglove/schemas/jsonschema.js";
import Ajv from "ajv";
import WebSocket from "ws";
import { Crane, eventually } from "./services.mjs";

const { FoxgloveClient } = protocol;
const [bin, recording, out] = process.argv.slice(2);
mkdirSync(out, { recursive: true });
const crane = new Crane(bin, recording, join(out, "foxglove-logs"));
const ajv = new Ajv({ strict: false });

async function step(name, run) {
  const begin = Date.now();
  const figure = await run();
  console.log(`ok  ${name}${figure === undefined ? "" : `: ${figure}`}  (${Date.now() - begin} ms)`);
}

/** Words for people aside. */
function bare(schema) {
  if (Array.isArray(schema)) return schema.map(bare);
  if (typeof schema !== "object" || schema === null) return schema;
  return Object.fromEntries(
    Object.entries(schema)
      .filter(([key, value]) => !(key === "$comment" || (key === "description" && typeof value === "string")))
      .map(([key, value]) => [key, bare(value)]),
  );
}

/** One viewer: what it was told. */
class Viewer {
  channels = new Map();
  statuses = [];
  newest = new Map(); // by topic
  counts = new Map();
  log = [];

  constructor(url, protocols, tls = {}) {
    this.socket = new WebSocket(url, protocols, tls);
    this.client = new FoxgloveClient({ ws: this.socket });
    this.client.on("serverInfo", (info) => (this.info = info));
    this.client.on("status", (status) => this.statuses.push(status));
    this.client.on("advertise", (list) => list.forEach((c) => this.channels.set(c.topic, c)));
    this.client.on("error", (error) => (this.error = error));
    this.client.on("close", () => (this.closed = true));
    const topics = (this.topics = new Map());
    this.client.on("message", ({ subscriptionId, timestamp, data }) => {
      const topic = topics.get(subscriptionId) ?? "of no subscription of ours";
      const message = JSON.parse(Buffer.from(data.buffer, data.byteOffset, data.byteLength).toString());
      this.newest.set(topic, { timestamp, message });
      if (topic === "/log") this.log.push(message);
      this.counts.set(topic, (this.counts.get(topic) ?? 0) + 1);
    });
  }
  async ready() {
    await eventually("advertised", () => this.error ? Promise.reject(this.error) : this.channels.size > 0, 20);
    return this;
  }
  subscribe(topic) {
    const id = this.client.subscribe(this.channels.get(topic).id);
    this.topics.set(id, topic);
    return id;
  }
  got(topic, test = () => true) {
    return eventually(`a message of ${topic}`, () => {
      const one = this.newest.get(topic);
      return one && test(one.message) && one.message;
    });
  }
}

/** Values of a packed message: by its fields. */
function unpack(message, stride) {
  const bytes = Buffer.from(message.data, "base64");
  const read = { 1: (at) => bytes.readUInt8(at), 7: (at) => bytes.readFloatLE(at) };
  const rows = [];
  for (let at = 0; at + stride <= bytes.length; at += stride)
    rows.push(Object.fromEntries(message.fields.map((f) => [f.name, read[f.type](at + f.offset)])));
  assert.equal(rows.length * stride, bytes.length);
  return rows;
}

/** Two CAs, a server and a client of the first, a stranger of the other. */
function makeIdentities(folder) {
  const path = (name) => join(folder, name);
  const openssl = (...more) => {
    const run = spawnSync("openssl", more, { encoding: "utf8" });
    assert.equal(run.status, 0, run.stderr);
  };
  const request = (name) => ["req", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-keyout", path(`${name}.key`), "-subj", `/CN=${name}`];
  for (const ca of ["ca", "other"]) openssl(...request(ca), "-x509", "-days", "2", "-out", path(`${ca}.pem`));
  for (const [name, ca] of [["server", "ca"], ["client", "ca"], ["stranger", "other"]]) {
    openssl(...request(name), "-addext", "subjectAltName=IP:127.0.0.1", "-out", path(`${name}.csr`));
    openssl("x509", "-req", "-copy_extensions", "copy", "-days", "1", "-in", path(`${name}.csr`), "-CA", path(`${ca}.pem`), "-CAkey", path(`${ca}.key`), "-CAcreateserial", "-out", path(`${name}.pem`));
  }
  return { path };
}

/** A client by hand that never reads, and says what it is told to. */
function rawClient(url, protocol) {
  const { hostname, port } = new URL(url);
  const socket = connect(Number(port), hostname);
  socket.on("error", () => {});
  const raw = { socket, ended: false };
  socket.on("close", () => (raw.ended = true));
  raw.open = new Promise((done) => socket.once("data", done));
  socket.write(
    `GET / HTTP/1.1\r\nHost: ${hostname}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n` +
      `Sec-WebSocket-Key: ${randomBytes(16).toString("base64")}\r\nSec-WebSocket-Protocol: ${protocol}\r\n\r\n`,
  );
  raw.say = (text) => {
    const head = text.length < 126 ? [0x81, 0x80 | text.length] : [0x81, 0xfe, text.length >> 8, text.length & 255];
    socket.write(Buffer.concat([Buffer.from([...head, 0, 0, 0, 0]), Buffer.from(text)]));
  };
  return raw;
}

/** Whether the gateway still holds the connection: who does not read is not told of its end. */
function isOpen(socket) {
  const port = `:${socket.localPort.toString(16).toUpperCase().padStart(4, "0")}`;
  const line = readFileSync("/proc/net/tcp", "latin1").split("\n").find((l) => l.trim().split(/\s+/)[2]?.endsWith(port));
  return line?.trim().split(/\s+/)[3] === "01";
}

let url;
try {
  crane.startAll();
  url = await crane.url();
  const ws = url.replace("http", "ws");
  await step("the map of a whole lap arrives at the gateway", () =>
    eventually("valid map", async () => {
      const s = await crane.status(url).catch(() => null);
      return s?.map?.valid && s.map.revision > 30 ? `revision ${s.map.revision}` : null;
    }, 150),
  );

  for (const name of ["foxglove.sdk.v1", FoxgloveClient.SUPPORTED_SUBPROTOCOL])
    await step(`speaks ${name}`, async () => {
      const viewer = await new Viewer(ws, [name]).ready();
      assert.equal(viewer.socket.protocol, name);
      assert.deepEqual(viewer.info.capabilities, []);
      viewer.client.close();
    });
  await step("of both it takes the newer; of none it says what it speaks", async () => {
    const viewer = await new Viewer(ws, [FoxgloveClient.SUPPORTED_SUBPROTOCOL, "foxglove.sdk.v1"]).ready();
    assert.equal(viewer.socket.protocol, "foxglove.sdk.v1");
    viewer.client.close();
    const other = new Viewer(ws, ["foxglove.sdk.v9"]);
    await eventually("refused", () => other.error);
    assert.match(other.error.message, /400/);
    assert.match(await (await fetch(url)).text(), /<html|API/, "the page is there still");
  });

  const viewer = await new Viewer(ws, ["foxglove.sdk.v1"]).ready();
  await step("each channel's schema is Foxglove's own", () => {
    for (const channel of viewer.channels.values()) {
      const own = schemas[channel.schemaName.replace("foxglove.", "")];
      assert.ok(own, channel.schemaName);
      assert.deepEqual(JSON.parse(channel.schema), bare(own), channel.schemaName);
      assert.deepEqual([channel.encoding, channel.schemaEncoding], ["json", "jsonschema"]);
    }
    return [...viewer.channels.values()].map((c) => `${c.topic} ${c.schemaName}`).join(", ");
  });

  for (const topic of viewer.channels.keys()) viewer.subscribe(topic);
  await step("each channel says something, as its schema has it", async () => {
    const sizes = [];
    for (const [topic, channel] of viewer.channels) {
      const message = await viewer.got(topic);
      const check = ajv.compile(schemas[channel.schemaName.replace("foxglove.", "")]);
      assert.ok(check(message), `${topic}: ${JSON.stringify(check.errors)}`);
      sizes.push(`${topic} ${JSON.stringify(message).length} bytes`);
    }
    return sizes.join(", ");
  });

  await step("points of the cloud, put where the camera is, lie where the map has heights", async () => {
    const tf = await viewer.got("/tf");
    const camera = tf.transforms.find((t) => t.child_frame_id === "camera");
    assert.equal(camera.parent_frame_id, "map");
    const { x, y, z, w } = camera.rotation;
    const turn = ([a, b, c]) => {
      // v + 2 q x (q x v + w v)
      const cross = ([p, q, r], [s, t, u]) => [q * u - r * t, r * s - p * u, p * t - q * s];
      const inner = cross([x, y, z], [a, b, c]).map((v, i) => v + w * [a, b, c][i]);
      return cross([x, y, z], inner).map((v, i) => [a, b, c][i] + 2 * v);
    };
    const cloud = await viewer.got("/cloud");
    const points = unpack(cloud, cloud.point_stride);
    assert.ok(points.length > 1000, `${points.length} points`);
    const heights = points.map((p) => camera.translation.z + turn([p.x, p.y, p.z])[2]).sort((a, b) => a - b);
    const low = heights[Math.floor(heights.length * 0.05)];
    assert.ok(Math.abs(low) < 0.05, `the floor is at ${low} m`);
    const names = cloud.fields.map((f) => f.name);
    if (names.includes("red")) assert.ok(points.every((p) => p.alpha === 255));
    return `${points.length} points, the lowest at ${low.toFixed(3)} m`;
  });

  await step("the map rests: grid and voxels say what the API says", async () => {
    crane.signal("camera", "SIGSTOP");
    const resting = { revision: -1, since: 0 };
    const revision = await eventually("no more changes", async () => {
      const { revision } = (await crane.status(url)).map;
      if (revision !== resting.revision) Object.assign(resting, { revision, since: Date.now() });
      return Date.now() - resting.since > 5000 && revision;
    });
    const said = await (await fetch(`${url}/api/v1/heights`)).json();
    const grid = await viewer.got("/heights");
    const cells = unpack(grid, grid.cell_stride);
    assert.ok(Math.abs(grid.pose.position.x - said.origin_x_m) < 1e-6);
    assert.equal(grid.column_count, said.columns);
    assert.equal(cells.length, said.columns * said.rows);
    cells.forEach((cell, i) => {
      assert.equal(cell.surface, said.surface[i]);
      assert.equal(cell.lower_bound, said.lower_bound[i]);
      if (said.height_m[i] === null) assert.ok(Number.isNaN(cell.height));
      else assert.ok(Math.abs(cell.height - said.height_m[i]) < 1e-3);
    });

    const voxels = await viewer.got("/voxels");
    const occupancy = Buffer.from(voxels.data, "base64");
    assert.equal(occupancy.length % voxels.slice_stride, 0);
    assert.equal(voxels.slice_stride, voxels.row_stride * voxels.row_count);
    const ply = Buffer.from(await (await fetch(`${url}/api/v1/map.ply?even_invalid=1`)).arrayBuffer());
    const vertices = Number(ply.toString("latin1").match(/element vertex (\d+)/)[1]);
    const occupied = occupancy.filter((v) => v === 2).length;
    assert.ok(occupancy.some((v) => v === 1) && occupancy.some((v) => v === 0), "free and unknown are told apart");
    assert.equal(occupied, vertices, "voxels of the same map, none put together");
    crane.signal("camera", "SIGCONT");
    return `revision ${revision}, ${cells.length} cells, ${occupied} of ${occupancy.length} voxels occupied`;
  });

  await step("what becomes invalid is said in the log", async () => {
    const said = (level, from) => eventually("a line of the map's", () => viewer.log.slice(from).find((m) => m.name === "map" && m.level === level));
    const from = viewer.log.length;
    crane.signal("mapper", "SIGSTOP");
    const line = await said(3, from);
    const later = viewer.log.length;
    crane.signal("mapper", "SIGCONT");
    await said(2, later);
    return line.message;
  });

  await step("unsubscribed is unsubscribed", async () => {
    const id = [...viewer.topics].find(([, topic]) => topic === "/tf")[0];
    viewer.client.unsubscribe(id);
    await sleep(500);
    const before = viewer.counts.get("/tf");
    const others = viewer.counts.get("/cloud");
    await eventually("others go on", () => viewer.counts.get("/cloud") > others + 3);
    assert.equal(viewer.counts.get("/tf"), before);
  });

  await step("what is not offered is an error, and the connection stays", async () => {
    const before = viewer.statuses.length;
    viewer.client.subscribe(4711);
    viewer.client.unsubscribe(4711);
    viewer.client.getParameters(["x"], "1");
    await eventually("told so", () => viewer.statuses.length >= before + 3);
    assert.ok(viewer.statuses.every((s) => s.level === 2 && s.message.length > 10));
    for (let i = 0; i < 40; ++i) viewer.subscribe("/log");
    await eventually("bounded", () => viewer.statuses.some((s) => /no more than 32/.test(s.message)));
    const clouds = viewer.counts.get("/cloud");
    await eventually("still served", () => viewer.counts.get("/cloud") > clouds);
  });

  await step("who floods, or says what is no message, is cut off; others go on", async () => {
    const flood = rawClient(url, "foxglove.sdk.v1");
    await flood.open;
    const timer = setInterval(() => flood.ended || flood.say('{"op":"subscribe","subscriptions":[]}'), 2);
    await eventually("the flood is cut off", () => flood.ended, 20);
    clearInterval(timer);
    for (const text of ["hello", "[]", '{"op":7}', '{"op":"subscribe"}', '{"op":"subscribe","subscriptions":[{"id":-1,"channelId":1}]}', "[".repeat(4000)]) {
      const loud = rawClient(url, "foxglove.sdk.v1");
      await loud.open;
      loud.say(text);
      await eventually(`cut off after ${text.slice(0, 20)}`, () => loud.ended, 20);
    }
    const clouds = viewer.counts.get("/cloud");
    await eventually("others go on", () => viewer.counts.get("/cloud") > clouds);
  });

  await step("who reads nothing is cut off, and costs one message", async () => {
    const stalled = rawClient(url, "foxglove.sdk.v1");
    await stalled.open;
    stalled.socket.pause();
    for (const [id, topic] of [[1, "/cloud"], [2, "/voxels"], [3, "/heights"], [4, "/camera/left"]])
      stalled.say(JSON.stringify({ op: "subscribe", subscriptions: [{ id, channelId: viewer.channels.get(topic).id }] }));
    assert.ok(isOpen(stalled.socket));
    await eventually("cut off", () => !isOpen(stalled.socket), 60);
    stalled.socket.destroy();
  });

  await step("clouds and frames are read only while somebody wants them", async () => {
    viewer.client.close();
    await eventually("closed", () => viewer.closed);
    const late = await new Viewer(ws, ["foxglove.sdk.v1"]).ready();
    late.subscribe("/cloud");
    const cloud = await late.got("/cloud");
    const age = Date.now() / 1000 - cloud.timestamp.sec;
    assert.ok(age < 5, `${age} s old`);
    late.client.close();
    assert.equal(viewer.counts.get("of no subscription of ours"), undefined);
  });

  await step("the same by TLS, for who has a certificate of the right CA", async () => {
    await crane.stop("gateway");
    const tls = makeIdentities(join(out, "foxglove-logs"));
    appendFileSync(
      crane.site,
      `gateway: {port: 0, tls_certificate: ${tls.path("server.pem")}, tls_key: ${tls.path("server.key")}, tls_client_ca: ${tls.path("ca.pem")}}\n`,
    );
    writeFileSync(crane.site, readFileSync(crane.site, "utf8").replace("gateway: {port: 0}\n", ""));
    await crane.restart("gateway");
    const { log } = crane.processes.get("gateway");
    const secure = await eventually("it serves by TLS", () => readFileSync(log, "utf8").match(/page and API: (https:[^\s]+)\//)?.[1]);
    const ca = readFileSync(tls.path("ca.pem"));
    const identity = (name) => ({ ca, cert: readFileSync(tls.path(`${name}.pem`)), key: readFileSync(tls.path(`${name}.key`)) });
    const by = secure.replace("https", "wss");
    const known = await new Viewer(by, ["foxglove.sdk.v1"], identity("client")).ready();
    known.subscribe("/cloud");
    await known.got("/cloud");
    for (const [who, how] of [
      ["without a certificate", { ca }],
      ["with another CA's certificate", identity("stranger")],
      ["who trusts another CA", { ...identity("client"), ca: readFileSync(tls.path("other.pem")) }],
    ]) {
      const other = new Viewer(by, ["foxglove.sdk.v1"], how);
      await eventually(`refused ${who}`, () => other.error, 20);
      assert.equal(other.channels.size, 0, who);
    }
    const plain = await fetch(secure.replace("https", "http"));
    assert.equal(plain.status, 400);
    assert.match(await plain.text(), /https/);
    const clouds = known.counts.get("/cloud");
    await eventually("goes on", () => known.counts.get("/cloud") > clouds);
    known.client.close();
  });
  console.log("all passed");
} finally {
  await crane.stopAll();
}
process.exit(process.exitCode ?? 0);
