// The tool that strokes on the canvas currently use, and the toolbar that selects the tool.

import { CellCursor } from "./cellcursor";
import type { Workbench } from "../workbench";
import { classOf } from "../data/labeling";
import { button, element } from "../../shared/dom";
import { CellBrush, Lasso, RegionBrush, Splitter, type Tool } from "./tools";

export type ModeName = "paint" | "brush" | "lasso" | "lasso-cells" | "split";

const BUTTONS: [ModeName, string, string][] = [
  ["paint", "Paint", "Paint whole regions (V)"],
  ["brush", "Brush", "Paint single cells (B)"],
  ["lasso", "Lasso", "Paint the regions inside a drawn outline (L; L again: single cells)"],
  ["split", "Split", "Cut a region in two (X)"],
];

export class Modes {
  readonly cellCursor: CellCursor;
  private readonly tools: Record<ModeName, Tool>;
  private readonly buttons = new Map<ModeName, HTMLButtonElement>();
  current: ModeName = "paint";
  readonly onChoose: (() => void)[] = []; // callbacks that run when a tool is chosen

  constructor(private readonly workbench: Workbench) {
    const line = element<SVGPolygonElement>("lasso-line");
    this.cellCursor = new CellCursor(workbench, element<SVGCircleElement>("cell-ring"));
    this.tools = {
      paint: new RegionBrush(workbench),
      brush: new CellBrush(workbench, element<SVGCircleElement>("brush-circle"), this.cellCursor),
      lasso: new Lasso(workbench, line, false),
      "lasso-cells": new Lasso(workbench, line, true),
      split: new Splitter(workbench),
    };
    for (const [name, text, tip] of BUTTONS) this.buttons.set(name, button(text, tip, () => this.choose(name)));
    element("modes").append(...this.buttons.values());
    workbench.events.on("current-paint", () => this.showPaint());
    workbench.session.events.on("state", () => this.showPaint());
    workbench.session.events.on("file", () => this.choose("paint"));
    workbench.session.events.on("suggestions", () => this.show());
    this.show();
  }

  get tool(): Tool {
    return this.tools[this.current];
  }

  choose(name: ModeName): void {
    if (this.workbench.session.mesh) this.tool.leave();
    this.current = name;
    if (this.workbench.session.mesh) this.tool.enter();
    this.show();
    for (const run of this.onChoose) run();
  }

  /** Switch between the lasso for regions and the lasso for single cells. */
  nextLasso(): void {
    this.choose(this.current === "lasso" ? "lasso-cells" : "lasso");
  }

  private show(): void {
    element("mode").textContent = this.tool.name;
    const nSuggested = this.workbench.session.suggested.entries.length;
    const ofSuggestions = "A accepts a suggestion, R rejects it, J goes to the next · ";
    element("hint").textContent = `${nSuggested ? ofSuggestions : ""}${this.tool.hint}`;
    const shown = this.current === "lasso-cells" ? "lasso" : this.current;
    for (const [name, one] of this.buttons) one.ariaPressed = String(name === shown);
  }

  private showPaint(): void {
    const { currentPaint, session } = this.workbench;
    const entry = session.state.classes.find(({ id }) => id === classOf(currentPaint));
    const [swatch, name] = element("brush-class").children as unknown as HTMLElement[];
    swatch.style.background = this.workbench.paintColor(currentPaint);
    name.textContent = entry ? this.workbench.paintName(currentPaint) : "No class (erases)";
  }
}
