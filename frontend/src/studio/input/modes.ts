// The tool that strokes on the canvas currently use, and the toolbar that selects the tool.

import { CellCursor } from "./cellcursor";
import type { Workbench } from "../workbench";
import { classOf } from "../data/labeling";
import { button, element } from "../../shared/dom";
import { CellBrush, Lasso, OUTLINES, RegionBrush, Splitter, type Tool } from "./tools";
import { text } from "../text/index";

export type ModeName = "paint" | "brush" | "ball" | "lasso" | "lasso-cells" | "split";

const words = text.tools;

const BUTTONS: [ModeName, string, string][] = [
  ["paint", words.paint, words.paintTip],
  ["brush", words.brush, words.brushTip],
  ["lasso", words.outlines.lasso, words.lassoTip],
  ["split", words.split, words.splitTip],
];

export class Modes {
  readonly cellCursor: CellCursor;
  private readonly tools: Record<ModeName, Tool>;
  private readonly lassos: [Lasso, Lasso];
  private readonly buttons = new Map<ModeName, HTMLButtonElement>();
  current: ModeName = "paint";
  readonly onChoose: (() => void)[] = []; // callbacks that run when a tool is chosen

  constructor(private readonly workbench: Workbench) {
    const line = element<SVGPolygonElement>("lasso-line");
    this.cellCursor = new CellCursor(workbench, element<SVGCircleElement>("cell-ring"));
    const brush = (isBall: boolean): Tool => new CellBrush(workbench, element<SVGCircleElement>("brush-circle"), this.cellCursor, isBall);
    this.lassos = [new Lasso(workbench, line, false), new Lasso(workbench, line, true)];
    this.tools = {
      paint: new RegionBrush(workbench),
      brush: brush(false),
      ball: brush(true),
      lasso: this.lassos[0],
      "lasso-cells": this.lassos[1],
      split: new Splitter(workbench),
    };
    for (const [name, title, tip] of BUTTONS) this.buttons.set(name, button(title, tip, () => this.press(name)));
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
    this.workbench.drawing.setExact(name !== "paint" && name !== "lasso"); // other tools choose single cells
    if (this.workbench.session.mesh) this.tool.enter();
    this.show();
    for (const run of this.onChoose) run();
  }

  /** Switch between the lasso for regions and the lasso for single cells. */
  nextLasso(): void {
    this.choose(this.current === "lasso" ? "lasso-cells" : "lasso");
  }

  /** Switch between the brush on the surface and the ball. */
  nextBrush(): void {
    this.choose(this.current === "brush" ? "ball" : "brush");
  }

  /** Choose a lasso; if one is chosen already, switch to the next kind of outline. */
  nextOutline(): void {
    const isLasso = this.tool instanceof Lasso;
    const [{ outline }] = this.lassos;
    const next = isLasso ? OUTLINES[(OUTLINES.indexOf(outline) + 1) % OUTLINES.length] : outline;
    for (const one of this.lassos) one.outline = next;
    this.choose(isLasso ? this.current : "lasso");
  }

  private press(name: ModeName): void {
    if (name === "lasso") this.nextOutline();
    else this.choose(name);
  }

  private show(): void {
    this.buttons.get("lasso")!.textContent = words.outlines[this.lassos[0].outline];
    element("mode").textContent = this.tool.name;
    const nSuggested = this.workbench.session.suggested.entries.length;
    element("hint").textContent = (nSuggested ? words.suggestionHint : "") + this.tool.hint;
    const shown = this.current === "lasso-cells" ? "lasso" : this.current === "ball" ? "brush" : this.current;
    for (const [name, one] of this.buttons) one.ariaPressed = String(name === shown);
  }

  private showPaint(): void {
    const { currentPaint, session } = this.workbench;
    const entry = session.state.classes.find(({ id }) => id === classOf(currentPaint));
    const [swatch, name] = element("brush-class").children as unknown as HTMLElement[];
    swatch.style.background = this.workbench.paintColor(currentPaint);
    name.textContent = entry ? this.workbench.paintName(currentPaint) : text.erases;
  }
}
