// SPDX-License-Identifier: Apache-2.0
import type { Service, State } from "./state";
import { make, replace, shape } from "./dom";
import { seconds, tenths, texts, whole } from "./settings";
import { isSilent } from "./alarms";

/** Services with what they hand on a second and do not use, before anything fails. */
export class Health {
  private before = new Map<string, { published: number; at_ms: number; rate: number }>();

  constructor(private readonly place: HTMLElement) {}

  show(state: State): void {
    const rows = state.services.map((service) => this.row(service));
    if (rows.length === 0) return replace(this.place, make("tr", "", make("td", "", texts.nothing_heard)));
    replace(this.place, ...rows);
  }

  private row(service: Service): HTMLElement {
    const silent = isSilent(service);
    const word = silent ? "silent" : service.finished ? "finished" : service.status;
    const good = word === "ok" || word === "finished";
    const dropped = service.dropped.reduce((sum, d) => sum + d.count, 0);
    const note = silent
      ? texts.ago(seconds(Math.floor(service.age_s)))
      : [texts.rate(tenths(this.rate(service))), dropped > 0 ? texts.not_used(whole(dropped)) : ""]
          .filter((part) => part !== "")
          .join(", ");
    const row = make(
      "tr",
      good ? "good" : "abnormal",
      make("td", "", shape(good ? "ok" : "bad")),
      make("td", "", texts.names[service.service] ?? service.service),
      make("td", "word", texts.words[word] ?? word),
      make("td", "note", note),
    );
    row.title = service.message;
    return row;
  }

  /** Of what it hands on, over some seconds. */
  private rate(service: Service): number {
    const now = performance.now();
    const old = this.before.get(service.service);
    if (!old || service.published < old.published) {
      this.before.set(service.service, { published: service.published, at_ms: now, rate: 0 });
      return 0;
    }
    const passed_s = (now - old.at_ms) / 1000;
    if (passed_s < 3) return old.rate;
    const rate = (service.published - old.published) / passed_s;
    this.before.set(service.service, { published: service.published, at_ms: now, rate });
    return rate;
  }
}
