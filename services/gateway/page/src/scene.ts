// SPDX-License-Identifier: Apache-2.0
// What three.js draws, when something changed.

import {
  AmbientLight,
  BufferGeometry,
  Color,
  DirectionalLight,
  GridHelper,
  Group,
  Line,
  LineBasicMaterial,
  PerspectiveCamera,
  Raycaster,
  Scene,
  Vector2,
  Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import type { State } from "./state";
import { theme } from "./settings";

const dark = theme === "dark";

export class View3d {
  readonly scene = new Scene();
  readonly camera = new PerspectiveCamera(45, 1, 0.05, 500);
  dirty = true;
  touched = false; // the user chose what is to be seen
  private readonly renderer: WebGLRenderer;
  private readonly controls: OrbitControls;
  private readonly crane = new Group();

  /** Throws where there is no WebGL. */
  constructor(private readonly canvas: HTMLCanvasElement) {
    this.renderer = new WebGLRenderer({ canvas, antialias: true });
    this.renderer.localClippingEnabled = true;
    this.scene.background = new Color(dark ? "#1d1f21" : "#d4d6d8");
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.addEventListener("change", () => (this.dirty = true));
    this.controls.listenToKeyEvents(canvas); // arrows move
    this.controls.addEventListener("start", () => (this.touched = true));
    this.scene.add(new AmbientLight("#ffffff", 1.6));
    const sun = new DirectionalLight("#ffffff", 1.8);
    sun.position.set(-3, -5, 9);
    this.scene.add(sun, this.crane);
  }

  fit(low: Vector2, high: Vector2): void {
    const middle = low.clone().add(high).multiplyScalar(0.5);
    const size = Math.max(1, high.distanceTo(low));
    this.controls.target.set(middle.x, middle.y, 0);
    this.camera.position.set(middle.x, middle.y - 0.62 * size, 0.72 * size);
    this.controls.update();
    const old = this.scene.getObjectByName("metres");
    if (old) this.scene.remove(old);
    const grid = new GridHelper(2 * Math.ceil(size), 2 * Math.ceil(size), "#808080", dark ? "#44484c" : "#b4b7ba");
    grid.name = "metres";
    grid.rotation.x = Math.PI / 2;
    grid.position.set(Math.round(middle.x), Math.round(middle.y), -0.02);
    this.scene.add(grid);
    this.dirty = true;
  }

  /** Where the crane is, what its camera sees of the floor, zones. */
  show(state: State): void {
    for (const child of [...this.crane.children]) {
      this.crane.remove(child);
      (child as Line).geometry.dispose();
    }
    const ink = new LineBasicMaterial({ color: dark ? "#ffffff" : "#000000" });
    const line = (points: [number, number, number][]) =>
      this.crane.add(new Line(new BufferGeometry().setFromPoints(points.map((p) => new Vector3(...p))), ink));
    const ring = (corners: [number, number][], z: number) =>
      line([...corners, corners[0]!].map(([x, y]) => [x, y, z]));
    if (state.footprint.length === 4) ring(state.footprint, 0.01);
    if (state.position) {
      const { x_m: x, y_m: y } = state.position;
      line([[x, y, 0], [x, y, state.map.ceiling_m]]);
    }
    for (const zone of state.zones.filter((z) => z.active))
      for (const z of [zone.z_min_m + 0.01, zone.z_max_m]) ring(zone.corners, z);
    this.dirty = true;
  }

  /** A ray through a point of the canvas. */
  ray(x: number, y: number): { from: Vector3; way: Vector3 } {
    const caster = new Raycaster();
    const at = new Vector2((2 * x) / this.canvas.clientWidth - 1, 1 - (2 * y) / this.canvas.clientHeight);
    caster.setFromCamera(at, this.camera);
    return { from: caster.ray.origin, way: caster.ray.direction };
  }

  draw(): void {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const size = this.renderer.getSize(new Vector2());
    if (size.x !== width || size.y !== height) {
      this.renderer.setSize(width, height, false);
      this.camera.aspect = width / Math.max(1, height);
      this.camera.updateProjectionMatrix();
      this.dirty = true;
    }
    if (!this.dirty) return;
    this.dirty = false;
    this.renderer.render(this.scene, this.camera);
  }
}
