// SPDX-License-Identifier: Apache-2.0
// The one large statement. What it says holds for one moment only: without a fresh answer of a valid map by a
// gateway that is heard it is invalid.

import type { Clearance, MapState, Query, State } from "./state";
import { facts, make, replace, shape } from "./dom";
import { metres, percent, seconds, texts } from "./settings";

/** An answer holds no longer. */
export const ANSWER_LIVES_MS = 3000;
/** Each picture that comes makes the map incomplete for a moment. */
const INCOMPLETE_MS = 700;

export interface Asked {
  kind: "path" | "load" | "entered";
  query: Query;
  length_m: number;
  number: number; // another path or load: another number
}

export interface Answered {
  asked: Asked;
  answer: Clearance;
  at_ms: number; // performance.now()
}

export type Verdict = "clear" | "blocked" | "invalid" | "idle";

export function whyMapInvalid(map: MapState): string {
  if (!map.heard) return texts.not_heard;
  if (!map.alive) return texts.no_heartbeat;
  return texts.map_codes[map.reason_code] ?? map.reason;
}

/** What holds now. `whole_at_ms`: when the map was complete here last. */
export function verdictNow(
  lost: boolean,
  state: State | null,
  whole_at_ms: number,
  asked: Asked | null,
  answered: Answered | null,
  now_ms: number,
): { verdict: Verdict; why: string } {
  if (lost || !state) return { verdict: "invalid", why: texts.link_lost };
  if (!state.map.valid) return { verdict: "invalid", why: whyMapInvalid(state.map) };
  if (now_ms - whole_at_ms > INCOMPLETE_MS) return { verdict: "invalid", why: texts.incomplete };
  if (!asked) return { verdict: "idle", why: texts.idle_text };
  if (!answered || answered.asked.kind !== asked.kind || answered.asked.number !== asked.number)
    return { verdict: "invalid", why: texts.waiting };
  if (now_ms - answered.at_ms > ANSWER_LIVES_MS) return { verdict: "invalid", why: texts.no_answer };
  const reason = texts.reasons[answered.answer.reason] ?? answered.answer.text;
  const named = state.zones.find((zone) => zone.id === answered.answer.zone)?.name;
  return {
    verdict: answered.answer.verdict,
    why: answered.answer.reason === "zone" && named ? `${reason}: ${named}` : reason,
  };
}

export function showStatement(
  place: HTMLElement,
  now: { verdict: Verdict; why: string },
  state: State | null,
  asked: Asked | null,
  answered: Answered | null,
): void {
  const word = {
    clear: texts.clear_word,
    blocked: texts.blocked_word,
    invalid: texts.invalid_word,
    idle: texts.idle_word,
  }[now.verdict];
  place.dataset.verdict = now.verdict;
  const rows: [string, string][] = [];
  const question =
    asked === null
      ? ""
      : `${
          asked.kind === "path"
            ? texts.asked_path(metres(asked.length_m))
            : asked.kind === "load"
              ? texts.asked_load
              : texts.asked_entered
        }, ${texts.underside(metres(asked.query.path[0]!.z_m))}`;
  const holds = now.verdict === "clear" || now.verdict === "blocked";
  if (holds && asked && answered) {
    const a = answered.answer;
    const z = metres(asked.query.path[0]!.z_m);
    rows.push([texts.safe, a.safe_height_m === null ? texts.safe_none(z) : metres(a.safe_height_m)]);
    rows.push([texts.oldest, a.oldest_age_s === null ? texts.never : texts.ago(seconds(a.oldest_age_s))]);
    rows.push([texts.unknown_share, percent(a.unknown_fraction)]);
  }
  if (state && state.map.last_frame_age_s !== null)
    rows.push([texts.frame, texts.ago(seconds(state.map.last_frame_age_s))]);
  const head = make("div", "head", shape(now.verdict), make("strong", "word", word));
  const parts: Node[] = [head, make("p", "why", now.why)];
  if (question !== "" && now.verdict !== "idle") parts.push(make("p", "question", question));
  if (holds && answered?.answer.slow_down) parts.push(make("p", "why", texts.slow));
  replace(place, ...parts, facts(rows));
}
