// The texts of the studio in the language in use, and the static texts of the page.

import { en, touch } from "./en";

export type Text = typeof en;

const isTouched = typeof matchMedia === "function" && matchMedia("(pointer: coarse)").matches; // false in tests without a page

export const text: Text = isTouched ? touch : en;

/** Attributes of index.html with the key of a text, and where the text is put. */
const PLACES: Record<string, (element: HTMLElement, value: string) => void> = {
  "data-text": (element, value) => (element.textContent = value),
  "data-html": (element, value) => (element.innerHTML = value),
  "data-title": (element, value) => (element.title = value),
  "data-label": (element, value) => element.setAttribute("aria-label", value),
  "data-placeholder": (element, value) => element.setAttribute("placeholder", value),
};

/** Put the texts into the page. */
export function fillPage(): void {
  document.documentElement.lang = text.language;
  for (const [attribute, put] of Object.entries(PLACES)) {
    for (const element of document.querySelectorAll<HTMLElement>(`[${attribute}]`)) {
      const key = element.getAttribute(attribute) as keyof Text["page"];
      if (!(key in text.page)) throw new Error(`text.page has no ${key}`);
      put(element, text.page[key]);
    }
  }
}
