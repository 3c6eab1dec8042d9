// Keyboard commands. The table of keys is also the content of the help dialog.

import type { Workbench } from "../workbench";
import type { ClipBox } from "./clip";
import type { Modes } from "./modes";
import type { Palette } from "../panels/palette";
import type { Comparison } from "../panels/comparison";
import type { Suggestions } from "../panels/suggestions";
import type { Walk } from "./walk";
import { savedText } from "../panels/notices";
import { SCHEMES } from "./pointer";
import type { Views } from "../panels/views";
import { element, make, onClick } from "../../shared/dom";

interface Key {
  names: string[]; // names of keys, as returned by `nameOf`
  shown?: string; // key name in the help dialog; by default names[0], empty to omit the key
  what: string; // description in the help dialog
  run: () => void;
  paints?: boolean; // whether the key changes the class of the active region or cell
}

const ARROWS: [string, number, number][] = [["Left", -1, 0], ["Right", 1, 0], ["Up", 0, -1], ["Down", 0, 1]];
const FIELDS = "input:not([type=radio]):not([type=checkbox]):not([type=range]), select, textarea";

// Keys of the number pad in the Blender scheme, and the names of keys with the same function.
const NUMPAD: Record<string, string> = { Numpad1: "Alt+1", Numpad3: "Alt+2", Numpad7: "Alt+3", NumpadDecimal: "g" };

interface Parts {
  modes: Modes;
  views: Views;
  clip: ClipBox;
  comparison: Comparison;
  palette: Palette;
  suggestions: Suggestions;
  walk: Walk;
  goToFile: (steps: number) => void;
}

export class Keys {
  private readonly groups: Record<string, Key[]>;
  private readonly table = new Map<string, Key>();
  private readonly help = element<HTMLDialogElement>("help");
  private readonly scheme = element<HTMLSelectElement>("scheme");

  private readonly modes: Modes;
  private readonly walk: Walk;

  constructor(private readonly workbench: Workbench, { modes, views, clip, comparison, palette, suggestions, walk, goToFile }: Parts) {
    this.modes = modes;
    this.walk = walk;
    this.groups = {
      Labeling: this.labeling(palette),
      Objects: this.objects(),
      Regions: this.regions(),
      Modes: this.modeKeys(),
      View: [...this.view(views), this.textureKey(comparison)],
      Sections: this.sections(clip),
      Suggestions: [
        { names: ["a"], what: "accept the suggestion under the pointer, or the chosen one", run: () => suggestions.accept() },
        { names: ["Shift+a"], what: "accept the suggestion as an object of the chosen class", run: () => suggestions.accept(true) },
        { names: ["r"], what: "reject the suggestion", run: () => suggestions.reject() },
        { names: ["j"], what: "next suggestion, in order of decreasing score", run: () => suggestions.next() },
      ],
      "Comparison of two works": [
        { names: ["d"], what: "next difference, in order of decreasing area; after the last one: the largest again", run: () => void comparison.next() },
        { names: [], shown: "T", what: "in the region: take the labels of the other file", run: () => undefined },
        { names: ["y"], what: "in the region: keep your labels", run: () => void comparison.settle("mine") },
      ],
      Files: [
        { names: ["Ctrl+s"], what: "show when the labels were saved", run: () => this.saySaved() },
        { names: [], shown: "Reviewed", what: "the box below “Labeled” marks the labels as reviewed, and shows later changes", run: () => undefined },
        { names: ["PageDown"], what: "next file", run: () => goToFile(1) },
        { names: ["PageUp"], what: "previous file", run: () => goToFile(-1) },
      ],
    };
    for (const key of Object.values(this.groups).flat()) {
      for (const name of key.names) this.table.set(name, key);
    }
    onClick("help-button", () => this.openHelp());
    window.addEventListener("keydown", (event) => this.pressed(event));
    returnFocus(workbench.drawing.canvas);
  }

  private labeling(palette: Palette): Key[] {
    const { workbench, modes } = this;
    return [
      { names: ["/"], what: "find a class by its name, or make a new one", run: () => palette.open() },
      ...Array.from({ length: 9 }, (_, i) => this.classKey(String(i + 1))),
      {
        names: ["0"], what: "choose no class, so that strokes erase",
        run: () => {
          workbench.choose(0);
          workbench.drawing.canvas.focus();
        },
      },
      { names: ["Enter"], paints: true, what: "paint the chosen region; in split mode: cut the region", run: () => modes.tool.confirm() },
      { names: ["Delete", "Backspace"], paints: true, shown: "Delete", what: "remove the class of the region", run: () => modes.tool.erase() },
      { names: ["f"], paints: true, what: "paint the region, and similar unlabeled regions connected to it; the slider “Similar shapes” sets how many", run: () => void workbench.fillSimilar() },
      { names: ["Ctrl+z"], what: "undo, if the server answers", run: () => void workbench.session.undo() },
      { names: ["Ctrl+Shift+z", "Ctrl+y"], shown: "Ctrl+Shift+Z", what: "redo", run: () => void workbench.session.redo() },
    ];
  }

  private objects(): Key[] {
    const { workbench } = this;
    return [
      { names: ["o"], what: "new object of the chosen class", run: () => workbench.newObject() },
      { names: ["m"], what: "merge the object under the pointer into the chosen object", run: () => workbench.mergeObject(workbench.hoveredPaint) },
      { names: ["Shift+o"], what: "show only the object under the pointer", run: () => workbench.isolatePaint(workbench.hoveredPaint || workbench.currentPaint) },
      { names: ["k"], what: "paint only unlabeled cells; again: paint all cells", run: () => workbench.lock() },
    ];
  }

  private saySaved(): void {
    const { session } = this.workbench;
    this.workbench.say(`${savedText(session)}, in ${session.state.work}. Each stroke is saved immediately.`);
  }

  private sections(clip: ClipBox): Key[] {
    return [
      ...["x", "y", "z"].map((name, axis) => ({
        names: [`Alt+${name}`], shown: axis ? "" : "Alt+X, Y, Z", what: "show one half of the mesh; again: the other half; again: the whole mesh",
        run: () => clip.cycle(axis),
      })),
      { names: ["c"], what: "show or remove the clip box", run: () => clip.toggle() },
      { names: [".", ">"], shown: ". and ,", what: "move the side that was moved last", run: () => clip.nudge(1) },
      { names: [",", "<"], shown: "", what: "", run: () => clip.nudge(-1) },
    ];
  }

  private classKey(key: string): Key {
    return {
      names: [key],
      shown: key === "1" ? "1 … 9" : "",
      what: "choose a class; its key’s box assigns a key, and other keys have the classes that were used last",
      run: () => {
        const id = this.workbench.classKeys.classOf(key);
        if (!id) return this.workbench.say(`No class has the key ${key}.`);
        this.workbench.choose(id);
        this.workbench.drawing.canvas.focus();
        this.workbench.say(`${this.workbench.paintName(this.workbench.currentPaint)} is chosen.`);
      },
    };
  }

  private regions(): Key[] {
    const { workbench, modes } = this;
    return [
      { names: ["n"], what: "next region that is not hidden", run: () => workbench.moveCursor(1) },
      { names: ["p"], what: "previous region", run: () => workbench.moveCursor(-1) },
      { names: ["s"], what: "next unlabeled region that is not hidden, in order of decreasing area", run: () => workbench.showNextBare() },
      { names: ["Shift+s"], what: "let everything unlabeled blink", run: () => workbench.blinkBare() },
      { names: ["Shift+u"], what: "hide everything labeled", run: () => workbench.hideLabeled() },
      { names: ["+", "=", "]"], shown: "+ or ]", what: "grow the selected or painted area by a ring of regions; with the brush: larger radius", run: () => modes.tool.resize(true) },
      { names: ["-", "["], shown: "- or [", what: "shrink the selected or painted area by a ring of regions; with the brush: smaller radius", run: () => modes.tool.resize(false) },
      { names: ["h"], what: "hide the region", run: () => workbench.hideActive() },
      { names: ["Shift+h"], what: "hide all other regions", run: () => workbench.isolateActive() },
      { names: ["u", "Alt+h"], shown: "U", what: "show all cells", run: () => workbench.showAll() },
    ];
  }

  private modeKeys(): Key[] {
    const { modes } = this;
    return [
      { names: ["v", "Escape"], shown: "V or Esc", what: "paint regions; clear the selection", run: () => this.leave() },
      { names: ["b"], what: "brush single cells; again: all cells in a ball", run: () => modes.nextBrush() },
      { names: [], shown: "B, then arrows", what: "go from cell to cell; Enter paints the cell, Delete removes its class", run: () => undefined },
      { names: ["l"], what: "lasso for regions; again: lasso for single cells; with Alt: only the front piece", run: () => modes.nextLasso() },
      { names: ["Shift+l"], what: "lasso; again: rectangle; again: polygon", run: () => modes.nextOutline() },
      { names: ["x"], what: "split a region by strokes", run: () => modes.choose("split") },
      { names: ["Shift+x"], what: "divide the region into parts; the field “Parts” sets how many", run: () => void this.workbench.refineActive() },
      { names: ["?"], what: "this help", run: () => this.openHelp() },
    ];
  }

  private view(views: Views): Key[] {
    const { modes } = this;
    const { camera } = this.workbench.drawing;
    const arrows = (prefix: string, what: string, go: (x: number, y: number) => void): Key[] =>
      ARROWS.map(([name, x, y], i) => ({
        names: [`${prefix}Arrow${name}`], shown: i ? "" : `${prefix}Arrows`, what, run: () => go(x, y),
      }));
    return [
      ...arrows("", "turn the view; with the brush: go to the next cell", (x, y) => modes.tool.arrow(x, -y)),
      ...arrows("Shift+", "move the view", (x, y) => camera.pan(0.05 * x, 0.05 * y)),
      { names: ["i"], what: "zoom in", run: () => camera.zoomBy(1.25) },
      { names: ["Shift+i"], what: "zoom out", run: () => camera.zoomBy(0.8) },
      ...views.keys(),
      { names: ["q"], what: "walk inside: W, A, S and D move the eye, turning looks around; again: end", run: () => this.walk.toggle() },
    ];
  }

  private textureKey(comparison: Comparison): Key {
    const { blend } = this.workbench.drawing;
    const run = (): void => {
      if (comparison.isOpen) void comparison.settle("theirs");
      else if (!blend.toggle()) this.workbench.say("This file has no texture or colors.");
    };
    return { names: ["t"], what: "show only the texture or colors; again: hide them", run };
  }

  private leave(): void {
    this.modes.choose("paint");
    this.workbench.clearSelection();
  }

  private pressed(event: KeyboardEvent): void {
    const target = event.target as Element;
    if (document.querySelector("dialog[open]") || !this.workbench.session.paints || target.closest(FIELDS)) return;
    if (this.walk.press(event)) return event.preventDefault();
    const isBlender = this.scheme.value === "blender";
    // The other keys of the number pad must not choose classes, because Blender uses them to change the view.
    if (isBlender && /^Numpad\d$/.test(event.code) && !(event.code in NUMPAD)) return;
    const key = this.table.get((isBlender && NUMPAD[event.code]) || nameOf(event));
    if (!key || (target.matches("[type=range], [type=radio]") && /^(Arrow|Page|Home)/.test(event.key))) return;
    if (key.paints && !this.isOnMesh(event)) return this.refuse(event);
    event.preventDefault();
    key.run();
  }

  /** Whether the canvas has the focus or, for keys other than Enter, the pointer is over the mesh. */
  private isOnMesh({ target, key }: KeyboardEvent): boolean {
    return target === this.workbench.drawing.canvas || (key !== "Enter" && this.workbench.hoveredCell >= 0);
  }

  /** Explain why a key did not paint. Enter on a button or link activates that element, so nothing is said. */
  private refuse({ target, key }: KeyboardEvent): void {
    if (key === "Enter" && (target as Element).matches("a, button")) return;
    this.workbench.say("Nothing was painted: click on the mesh or press N first.");
  }

  private openHelp(): void {
    const rows = Object.values(this.groups).map((keys) => keys.flatMap(({ names, shown = names[0], what }) => {
      if (!shown) return [];
      const text = shown.length === 1 ? shown.toUpperCase() : shown.replace(/\+([a-z])$/, (_, letter: string) => `+${letter.toUpperCase()}`);
      return [[text, what] as const];
    }));
    const mouse = [...SCHEMES[this.scheme.value].rows, ["Wheel", "zoom"], ["Two fingers", "turn and zoom"], ["Three fingers", "move"]];
    const titles = ["Mouse", ...Object.keys(this.groups)];
    const sections = [mouse, ...rows].map((list, i) => make("section", {},
      make("h3", {}, titles[i]),
      make("dl", {}, ...list.flatMap(([how, what]) => [make("dt", {}, make("kbd", {}, how)), make("dd", {}, what)])),
    ));
    element("help-keys").replaceChildren(...sections);
    this.help.showModal();
  }
}

const RETURNING = "#next-bare, #new-object, #classes :is([type=radio], kbd, .none, output)";

/** Move the focus to the canvas after the pointer has chosen a list entry, class, object or region. */
function returnFocus(canvas: HTMLCanvasElement): void {
  let pressed: EventTarget | null = null;
  window.addEventListener("pointerdown", ({ target }) => (pressed = target));
  window.addEventListener("change", ({ target }) => {
    if (target === pressed && target instanceof HTMLSelectElement) canvas.focus();
  });
  window.addEventListener("click", ({ target, detail }) => {
    if (detail && (target as Element).matches(RETURNING)) canvas.focus(); // detail is 0 if a key was used instead of the pointer
  });
}

/** Name of a key with its modifiers. Shift is omitted for signs such as "?", which already depend on Shift. */
function nameOf(event: KeyboardEvent): string {
  const isSign = event.key.length === 1 && !/[a-z]/i.test(event.key);
  const parts: string[] = [];
  if (event.ctrlKey || event.metaKey) parts.push("Ctrl");
  if (event.altKey) parts.push("Alt");
  if (event.shiftKey && !isSign) parts.push("Shift");
  const isOdd = event.altKey && !/^[a-z]$/i.test(event.key); // on macOS, Alt changes the character that a key produces
  const letter = isOdd ? /^(?:Digit|Key)(\w)$/.exec(event.code)?.[1].toLowerCase() : undefined;
  parts.push(letter ?? (event.key.length === 1 ? event.key.toLowerCase() : event.key));
  return parts.join("+");
}
