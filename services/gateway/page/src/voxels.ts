// SPDX-License-Identifier: Apache-2.0
// Occupied voxels, as map.ply has them.

import { BoxGeometry, Color, Group, InstancedMesh, Matrix4, MeshLambertMaterial, SRGBColorSpace, type Plane } from "three";
import { PLYLoader } from "three/addons/loaders/PLYLoader.js";
import { viridis } from "./colours";

export class Voxels {
  readonly group = new Group();

  /** `section`: planes that cut. */
  constructor(private readonly section: Plane[]) {}

  /** How many there are. Throws saying why there are none. */
  async fetch(voxel_m: number, top_m: number): Promise<number> {
    const response = await fetch("/api/v1/map.ply?even_invalid=1");
    if (!response.ok) throw new Error(((await response.json()) as { error: string }).error);
    const points = new PLYLoader().parse(await response.arrayBuffer()).getAttribute("position");
    this.clear();
    const mesh = new InstancedMesh(
      new BoxGeometry(0.96 * voxel_m, 0.96 * voxel_m, 0.96 * voxel_m),
      new MeshLambertMaterial({ clippingPlanes: this.section }),
      points.count,
    );
    const at = new Matrix4();
    const colour = new Color();
    for (let i = 0; i < points.count; i++) {
      mesh.setMatrixAt(i, at.makeTranslation(points.getX(i), points.getY(i), points.getZ(i)));
      mesh.setColorAt(i, colour.setRGB(...viridis(points.getZ(i) / top_m), SRGBColorSpace));
    }
    this.group.add(mesh);
    return points.count;
  }
  clear(): void {
    for (const child of [...this.group.children]) {
      this.group.remove(child);
      (child as InstancedMesh).dispose();
    }
  }
}
