// SPDX-License-Identifier: Apache-2.0
import type { Clearance, ColumnHeight, Query } from "./state";

const LIMIT_MS = 3000;

async function answered<T>(path: string, init: RequestInit = {}): Promise<T> {
  const response = await fetch(path, { ...init, signal: AbortSignal.timeout(LIMIT_MS) });
  if (!response.ok) throw new Error(`${response.status}`);
  return (await response.json()) as T;
}

export function askHeight(x_m: number, y_m: number): Promise<ColumnHeight> {
  return answered(`/api/v1/height?x=${x_m}&y=${y_m}`);
}

export function askClearance(query: Query): Promise<Clearance> {
  return answered("/api/v1/clearance", {
    method: "POST",
    headers: { "Content-Type": "application/json" },
    body: JSON.stringify(query),
  });
}
