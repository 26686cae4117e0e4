// SPDX-License-Identifier: Apache-2.0
// What the gateway says; metres, seconds. See openapi.json.

export interface MapState {
  heard: boolean;
  alive: boolean;
  valid: boolean;
  complete: boolean;
  reason: string;
  reason_code: number;
  map_id: string;
  revision: number;
  voxel_m: number;
  last_frame_age_s: number | null;
  hoist: "not_used" | "known" | "lost";
  ceiling_m: number;
  forget_s: number;
}

export interface Zone {
  id: number;
  kind: "no_go" | "slow_down";
  active: boolean;
  z_min_m: number;
  z_max_m: number;
  name: string;
  corners: [number, number][];
}

export interface Hoist {
  hook_height_m: number;
  sling_m: number;
  load_size_m: [number, number, number];
  load_yaw_rad: number;
  sway_m: [number, number];
  offset_m: [number, number];
  ok: boolean;
  age_s: number;
}

export interface Service {
  service: string;
  status: "ok" | "degraded" | "failed";
  message: string;
  age_s: number;
  received: number;
  published: number;
  finished: boolean;
  dropped: { cause: string; count: number }[];
  stages: { stage: string; count: number; p50_ms: number; p99_ms: number; max_ms: number }[];
  figures: { name: string; value: number; sigma: number }[];
}

export interface State {
  time_ms: number;
  crane: number;
  generation: number;
  map: MapState;
  position: { x_m: number; y_m: number } | null;
  footprint: [number, number][];
  hoist: Hoist | null;
  zones: Zone[];
  services: Service[];
}

export interface Pose {
  x_m: number;
  y_m: number;
  z_m: number;
  yaw_rad: number;
}

export interface Query {
  path: Pose[];
  load: { size_x_m: number; size_y_m: number; size_z_m: number; above_m: number };
  margins: { horizontal_m: number; vertical_m: number };
}

export interface Clearance {
  verdict: "clear" | "blocked" | "invalid";
  reason: string;
  text: string;
  safe_height_m: number | null;
  safe_low_m: number | null;
  safe_high_m: number | null;
  first_blocking: { x_m: number; y_m: number; z_m: number } | null;
  oldest_age_s: number | null;
  unknown_fraction: number;
  slow_down: boolean;
  zone: number | null;
}

export interface ColumnHeight {
  x_m: number;
  y_m: number;
  surface: "unknown" | "floor" | "obstacle" | "stale";
  height_m: number | null;
  spread_m: number | null;
  lower_bound: boolean | null;
  free_to_m: number | null;
  views: number;
  age_s: number | null;
  map: MapState;
}
