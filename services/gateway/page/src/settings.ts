// SPDX-License-Identifier: Apache-2.0
// Language, theme and what else a link may say: ?lang=de&theme=dark&at=1.2,0.8

import { de } from "./texts/de";
import { en, type Texts } from "./texts/en";

const LANGUAGES: Record<string, Texts> = { en, de };

function chosen(name: string, allowed: string[], otherwise: string): string {
  const asked = new URLSearchParams(location.search).get(name) ?? localStorage.getItem(name);
  return asked !== null && allowed.includes(asked) ? asked : otherwise;
}

function change(name: string, value: string): void {
  localStorage.setItem(name, value);
  const url = new URL(location.href);
  url.searchParams.set(name, value);
  location.replace(url);
}

export const language = chosen(
  "lang",
  Object.keys(LANGUAGES),
  navigator.language.startsWith("de") ? "de" : "en",
);
export const texts: Texts = LANGUAGES[language]!;
export const theme = chosen(
  "theme",
  ["light", "dark"],
  matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light",
);

export function applySettings(): void {
  document.documentElement.lang = language;
  document.documentElement.dataset.theme = theme;
  const other = Object.keys(LANGUAGES).find((name) => name !== language)!;
  const languageButton = document.getElementById("language")!;
  languageButton.textContent = LANGUAGES[other]!.language;
  languageButton.onclick = () => change("lang", other);
  const themeButton = document.getElementById("theme")!;
  themeButton.textContent = texts.theme;
  themeButton.onclick = () => change("theme", theme === "dark" ? "light" : "dark");
}

/** The column that a link names. */
export function linkedColumn(): { x: number; y: number } | null {
  const parts = new URLSearchParams(location.search).get("at")?.split(",").map(Number);
  if (parts?.length !== 2 || !parts.every(Number.isFinite)) return null;
  return { x: parts[0]!, y: parts[1]! };
}

export function linkColumn(x: number, y: number): void {
  const url = new URL(location.href);
  url.searchParams.set("at", `${x.toFixed(3)},${y.toFixed(3)}`);
  history.replaceState(null, "", url);
}

/** Figures with their units, as the language writes them. */
const number = (digits: number) =>
  new Intl.NumberFormat(language, { minimumFractionDigits: digits, maximumFractionDigits: digits });
const two = number(2);
const one = number(1);
const none = number(0);

export function metres(v: number): string {
  return `${two.format(Math.abs(v) < 0.005 ? 0 : v)} m`;
}
export function seconds(s: number): string {
  if (s < 9.95) return `${one.format(Math.max(0, s))} s`;
  if (s < 120) return `${none.format(s)} s`;
  if (s < 7200) return `${none.format(s / 60)} min`;
  if (s < 48 * 3600) return `${one.format(s / 3600)} h`;
  return `${none.format(s / 86400)} d`;
}
export function percent(share: number): string {
  return `${one.format(100 * share)} %`;
}
export function whole(v: number): string {
  return none.format(v);
}
export function tenths(v: number): string {
  return one.format(v);
}
