// SPDX-License-Identifier: Apache-2.0
// What is not as it should be, until it is. Who acknowledged an alarm sees it on, without its blinking, also
// after the page was loaded again.

import type { Service, State } from "./state";
import { make, replace, shape } from "./dom";
import { seconds, texts } from "./settings";
import { whyMapInvalid } from "./statement";

const STORE = "acknowledged";
/** Every service speaks once a second. */
export const SILENT_S = 5;

export interface Alarm {
  id: string;
  title: string;
  text: string;
}

export function isSilent(service: Service): boolean {
  return service.age_s > SILENT_S && !service.finished;
}

export function alarmsOf(lost: boolean, state: State | null): Alarm[] {
  const out: Alarm[] = [];
  if (lost || !state) out.push({ id: "gateway", title: texts.alarm_gateway, text: "" });
  if (!state) return out;
  if (!state.map.valid)
    out.push({ id: `map-${state.map.reason_code}`, title: texts.alarm_map, text: whyMapInvalid(state.map) });
  else if (state.map.reason_code !== 0)
    out.push({
      id: `map-${state.map.reason_code}`,
      title: texts.alarm_drift,
      text: texts.map_codes[state.map.reason_code] ?? state.map.reason,
    });
  for (const service of state.services) {
    // The gateway's and the clearance service's own trouble is the map's.
    const follows = ["gateway", "clearance", "mapper", "ros2_mirror"].includes(service.service);
    const name = texts.names[service.service] ?? service.service;
    if (isSilent(service))
      out.push({
        id: `silent-${service.service}`,
        title: texts.alarm_service(name),
        text: texts.silent(seconds(Math.floor(service.age_s))),
      });
    else if (service.status === "failed" || (service.status === "degraded" && !follows))
      out.push({ id: `service-${service.service}`, title: texts.alarm_service(name), text: service.message });
  }
  return out;
}

export class Alarms {
  private acknowledged: Set<string>;

  constructor(private readonly place: HTMLElement) {
    this.acknowledged = new Set(JSON.parse(localStorage.getItem(STORE) ?? "[]") as string[]);
    place.addEventListener("click", (event) => {
      const id = (event.target as HTMLElement).dataset.alarm;
      if (id === undefined) return;
      this.acknowledged.add(id);
      this.keep();
    });
  }

  show(alarms: Alarm[], told: boolean): void {
    // One that ended is a new one when it comes again; while nothing is told nothing ended.
    const present = new Set(alarms.map((alarm) => alarm.id));
    const gone = [...this.acknowledged].filter((id) => !present.has(id) && (told || id === "gateway"));
    for (const id of gone) this.acknowledged.delete(id);
    if (gone.length > 0) this.keep();
    if (alarms.length === 0) return replace(this.place, make("li", "none", texts.no_alarms));
    replace(
      this.place,
      ...alarms.map((alarm) => {
        const known = this.acknowledged.has(alarm.id);
        const item = make("li", known ? "known" : "fresh", shape("bad"));
        item.append(make("div", "", make("strong", "", alarm.title), make("span", "", alarm.text)));
        if (known) item.append(make("em", "", texts.acknowledged));
        else {
          const button = make("button", "", texts.acknowledge);
          button.dataset.alarm = alarm.id;
          item.append(button);
        }
        return item;
      }),
    );
  }

  private keep(): void {
    localStorage.setItem(STORE, JSON.stringify([...this.acknowledged]));
  }
}
