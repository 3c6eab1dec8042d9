// Look up elements of the page by their ids, and create elements.

export function part<T extends Element = HTMLElement>(id: string): T {
  const found = document.getElementById(id);
  if (!found) throw new Error(`the page has no part "${id}"`);
  return found as unknown as T;
}

/** A new element with text and attributes. */
export function make<K extends keyof HTMLElementTagNameMap>(
  tag: K, attributes: Record<string, string> = {}, ...children: (Node | string)[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

/** A new button with a tooltip. */
export function button(text: string, title: string, run: () => void): HTMLButtonElement {
  const made = make("button", { type: "button", title }, text);
  made.addEventListener("click", run);
  return made;
}

export const onClick = (id: string, run: () => void): void => part(id).addEventListener("click", run);

/** Enable or disable a control; its tooltip says what it does, or why it is disabled. */
export function allow(control: HTMLButtonElement | HTMLInputElement, isAllowed: boolean, tip: string, reason: string): void {
  control.disabled = !isAllowed;
  control.title = isAllowed ? tip : reason;
}

/** A number with its noun, in the plural if needed. */
export const counted = (n: number, noun: string, nouns = `${noun}s`): string =>
  `${n.toLocaleString("en")} ${n === 1 ? noun : nouns}`;

export const percent = (share: number): string => `${(100 * share).toFixed(share < 0.1 ? 1 : 0)} %`;
