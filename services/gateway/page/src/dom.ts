// SPDX-License-Identifier: Apache-2.0
export function byId<T extends HTMLElement = HTMLElement>(id: string): T {
  return document.getElementById(id) as T;
}

/** An element with its class, text or children. */
export function make(tag: string, className = "", ...inside: (Node | string)[]): HTMLElement {
  const element = document.createElement(tag);
  if (className !== "") element.className = className;
  element.append(...inside);
  return element;
}

/** Names and values, one below the other. */
export function facts(rows: [string, string][]): HTMLElement {
  const list = make("dl", "facts");
  for (const [name, value] of rows) list.append(make("dt", "", name), make("dd", "", value));
  return list;
}

/** Children are replaced only when something changed: a screen reader says each change. */
export function replace(parent: HTMLElement, ...children: Node[]): void {
  const fresh = make("div", "", ...children);
  if (parent.innerHTML !== fresh.innerHTML) parent.replaceChildren(...fresh.childNodes);
}

const SVG = "http://www.w3.org/2000/svg";

/** Each word has a shape of its own, told apart without colour. */
export function shape(kind: "clear" | "blocked" | "invalid" | "idle" | "ok" | "bad"): SVGSVGElement {
  const svg = document.createElementNS(SVG, "svg");
  svg.setAttribute("viewBox", "0 0 48 48");
  svg.setAttribute("aria-hidden", "true");
  svg.setAttribute("class", `shape ${kind}`);
  const paths: Record<typeof kind, string> = {
    clear: "M24 4a20 20 0 1 0 .01 0zM14 25l7 7 14-15",
    blocked: "M5 5h38v38H5zM12 24h24",
    invalid: "M24 3 46 43H2zM24 18v12M24 35v3",
    idle: "M24 6a18 18 0 1 0 .01 0zM19 19a5 5 0 1 1 7 5q-2 1-2 4M24 32v3",
    ok: "M24 10a14 14 0 1 0 .01 0z",
    bad: "M24 5 45 43H3z",
  };
  const path = document.createElementNS(SVG, "path");
  path.setAttribute("d", paths[kind]);
  svg.append(path);
  return svg;
}
