// SPDX-License-Identifier: Apache-2.0
import type { Point } from "./view";

/** The API takes 256 poses; a finger's path needs far fewer. */
const MOST_POINTS = 64;

export function lengthOf(points: Point[]): number {
  let sum = 0;
  for (let i = 1; i < points.length; i++)
    sum += Math.hypot(points[i]!.x - points[i - 1]!.x, points[i]!.y - points[i - 1]!.y);
  return sum;
}

/** Straight legs that stay within `within` of what was drawn (Douglas and Peucker). */
function legs(points: Point[], within: number): Point[] {
  if (points.length < 3) return points;
  const a = points[0]!;
  const b = points[points.length - 1]!;
  const length = Math.hypot(b.x - a.x, b.y - a.y);
  let farthest = 0;
  let at = 0;
  for (let i = 1; i < points.length - 1; i++) {
    const p = points[i]!;
    const aside =
      length === 0
        ? Math.hypot(p.x - a.x, p.y - a.y)
        : Math.abs((b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x)) / length;
    if (aside > farthest) {
      farthest = aside;
      at = i;
    }
  }
  if (farthest <= within) return [a, b];
  return [...legs(points.slice(0, at + 1), within).slice(0, -1), ...legs(points.slice(at), within)];
}

export function simplified(points: Point[]): Point[] {
  for (let within = 0.03; ; within *= 2) {
    const out = legs(points, within);
    if (out.length <= MOST_POINTS) return out;
  }
}
