// Sections of the panel that can be folded. The browser remembers which are open.

import { remember, remembered } from "../session/remembered";

const HIGH = 900; // height in pixels of a window in which all sections are open at first

export function watchFolds(): void {
  for (const fold of document.querySelectorAll<HTMLDetailsElement>("#panel details")) {
    const key = `superfacets fold ${fold.id}`;
    const stored = remembered(key);
    fold.open = stored === null ? fold.open || window.innerHeight >= HIGH : stored === "open";
    fold.querySelector("summary")!.addEventListener("click", () => remember(key, fold.open ? "closed" : "open"));
  }
}
