// Finds, creates and changes elements of the document, and formats numbers for them.

export function element<T extends Element = HTMLElement>(id: string): T {
  const found = document.getElementById(id);
  if (!found) throw new Error(`the page has no element with id "${id}"`);
  return found as unknown as T;
}

/** A new element with attributes and children. */
export function make<K extends keyof HTMLElementTagNameMap>(
  tag: K, attributes: Record<string, string> = {}, ...children: (Node | string)[]
): HTMLElementTagNameMap[K] {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.append(...children);
  return made;
}

/** A new button with a tooltip and a click handler. */
export function button(text: string, title: string, run: () => void): HTMLButtonElement {
  const made = make("button", { type: "button", title }, text);
  made.addEventListener("click", run);
  return made;
}

export const onClick = (id: string, run: () => void): void => element(id).addEventListener("click", run);

/** Enable a control and set its tooltip to `tip`, or disable the control and set the tooltip to `reason`. */
export function allow(control: HTMLButtonElement | HTMLInputElement, isAllowed: boolean, tip: string, reason: string): void {
  control.disabled = !isAllowed;
  control.title = isAllowed ? tip : reason;
}

/** A number and its noun in singular or plural, for example "2 regions". */
export const counted = (n: number, noun: string, nouns = `${noun}s`): string =>
  `${n.toLocaleString("en")} ${n === 1 ? noun : nouns}`;

/** A fraction in percent. Nearly all is not shown as 100 %. */
export const percent = (fraction: number): string =>
  fraction >= 0.995 && fraction < 1 - 1e-9 ? "> 99 %" : `${(100 * fraction).toFixed(fraction < 0.1 ? 1 : 0)} %`;
