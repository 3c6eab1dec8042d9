// Dialog that finds a class by its name, and makes new classes.

import { classesFor, hasNamed } from "../data/classkeys";
import { classOf } from "../data/labeling";
import { element, make, onClick } from "../../shared/dom";
import type { Workbench } from "../workbench";
import { text } from "../text/index";

interface Choice {
  shown: string;
  color: string; // CSS color; empty if there is none
  key: string;
  run: () => void;
}

export class Palette {
  private readonly dialog = element<HTMLDialogElement>("palette");
  private readonly field = element<HTMLInputElement>("palette-text");
  private readonly list = element("palette-list");
  private choices: Choice[] = [];
  private at = 0; // index of the marked choice

  /** `add` makes a class and chooses it. */
  constructor(private readonly workbench: Workbench, private readonly add: (name: string, isStuff: boolean) => Promise<void>) {
    onClick("find-class", () => this.open());
    this.field.addEventListener("input", () => this.fill());
    this.field.addEventListener("keydown", (event) => this.pressed(event));
    this.dialog.addEventListener("click", ({ target }) => target === this.dialog && this.dialog.close()); // a click outside the list
    this.dialog.addEventListener("close", () => workbench.drawing.canvas.focus());
  }

  open(): void {
    this.field.value = "";
    this.dialog.showModal();
    this.fill();
  }

  private fill(): void {
    const { classesByUse, currentPaint } = this.workbench;
    const found = classesFor(classesByUse, this.field.value);
    this.choices = [...found.map(({ id, name, color }) => this.choice(id, name, color)), ...this.additions()];
    const current = found.findIndex(({ id }) => id === classOf(currentPaint));
    this.list.replaceChildren(...this.choices.map((choice, i) => this.option(choice, i)));
    this.mark(this.field.value ? 0 : Math.max(0, current));
  }

  private choice(id: number, name: string, color: string): Choice {
    const { workbench } = this;
    const run = (): void => {
      workbench.choose(id);
      workbench.sayChosen();
    };
    return { shown: name, color, key: workbench.classKeys.keyOf(id), run };
  }

  /** Choices that make a class, if no class has the typed name. */
  private additions(): Choice[] {
    const name = this.field.value.trim();
    if (!name || hasNamed(this.workbench.session.state.classes, name)) return [];
    return [
      { shown: text.classes.addNamed(name), color: "", key: "", run: () => void this.add(name, false) },
      { shown: text.classes.addNamedStuff(name), color: "", key: "", run: () => void this.add(name, true) },
    ];
  }

  private option({ shown, color, key }: Choice, i: number): HTMLElement {
    const swatch = make("i");
    swatch.style.background = color;
    const option = make("li", { id: `palette-${i}`, role: "option" }, swatch, make("span", {}, shown), ...(key ? [make("kbd", {}, key)] : []));
    option.addEventListener("click", () => this.pick(i));
    return option;
  }

  private mark(at: number): void {
    const { length } = this.choices;
    this.at = length ? (at + length) % length : 0;
    [...this.list.children].forEach((option, i) => option.setAttribute("aria-selected", String(i === this.at)));
    this.field.setAttribute("aria-activedescendant", length ? `palette-${this.at}` : "");
    this.list.children[this.at]?.scrollIntoView({ block: "nearest" });
  }

  private pick(at: number): void {
    const choice = this.choices[at];
    if (!choice) return;
    this.dialog.close();
    choice.run();
  }

  private pressed(event: KeyboardEvent): void {
    const steps: Record<string, number> = { ArrowDown: 1, ArrowUp: -1, PageDown: 8, PageUp: -8 };
    if (event.isComposing || !(event.key in steps || event.key === "Enter")) return;
    event.preventDefault();
    if (event.key === "Enter") this.pick(this.at);
    else if (Math.abs(steps[event.key]) === 1) this.mark(this.at + steps[event.key]);
    else this.mark(Math.max(0, Math.min(this.choices.length - 1, this.at + steps[event.key])));
  }
}
