// Keyboard commands. The table of keys is also the content of the help dialog.

import type { Workbench } from "../workbench";
import type { ClipBox } from "./clip";
import type { Modes } from "./modes";
import type { Palette } from "../panels/palette";
import type { Comparison } from "../panels/comparison";
import type { Suggestions } from "../panels/suggestions";
import type { Walk } from "./walk";
import { savedText } from "../panels/notices";
import type { Scheme } from "./pointer";
import type { Views } from "../panels/views";
import { element, make, onClick } from "../../shared/dom";
import { text } from "../text/index";

const words = text.keys;

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
const NUMPAD: Record<string, string> = {
  Numpad1: "Alt+1", Numpad3: "Alt+2", Numpad7: "Alt+3", NumpadDecimal: "g", NumpadAdd: "i", NumpadSubtract: "Shift+i",
  NumpadDivide: "Shift+o",
};
const STEP = Math.PI / 12;
const TURNS: [string, number, number][] = [["4", STEP, 0], ["6", -STEP, 0], ["8", 0, STEP], ["2", 0, -STEP], ["9", Math.PI, 0]];

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

  constructor(private readonly workbench: Workbench, private readonly parts: Parts) {
    const { comparison, suggestions, goToFile } = parts;
    this.groups = {
      [text.help.labeling]: this.labeling(),
      [text.help.objects]: this.objects(),
      [text.help.regions]: this.regions(),
      [text.help.modes]: this.modeKeys(),
      [text.help.view]: [...this.view(), this.textureKey()],
      [text.help.sections]: this.sections(),
      [text.help.suggestions]: [
        { names: ["a"], what: words.accept, run: () => suggestions.accept() },
        { names: ["Shift+a"], what: words.acceptAs, run: () => suggestions.accept(true) },
        { names: ["r"], what: words.reject, run: () => suggestions.reject() },
        { names: ["j"], what: words.nextSuggestion, run: () => suggestions.next() },
      ],
      [text.help.comparison]: [
        { names: ["d"], what: words.nextDifference, run: () => void comparison.next() },
        { names: [], shown: "T", what: words.take, run: () => undefined },
        { names: ["y"], what: words.keep, run: () => void comparison.settle("mine") },
      ],
      [text.help.files]: [
        { names: ["Ctrl+s"], what: words.saved, run: () => this.saySaved() },
        { names: [], shown: words.reviewedKeys, what: words.reviewed, run: () => undefined },
        { names: ["PageDown"], what: words.nextFile, run: () => goToFile(1) },
        { names: ["PageUp"], what: words.previousFile, run: () => goToFile(-1) },
      ],
    };
    for (const key of Object.values(this.groups).flat()) {
      for (const name of key.names) {
        if (this.table.has(name)) throw new Error(words.isUsed(name));
        this.table.set(name, key);
      }
    }
    onClick("help-button", () => this.openHelp());
    window.addEventListener("keydown", (event) => this.pressed(event));
    returnFocus(workbench.drawing.canvas);
  }

  private labeling(): Key[] {
    const { workbench, parts: { modes, palette } } = this;
    return [
      { names: ["/"], what: words.find, run: () => palette.open() },
      ...Array.from({ length: 9 }, (_, i) => this.classKey(String(i + 1))),
      {
        names: ["0"], what: words.noClass,
        run: () => {
          workbench.choose(0);
          workbench.drawing.canvas.focus();
        },
      },
      { names: ["Enter"], paints: true, what: words.paint, run: () => modes.tool.confirm() },
      { names: ["Delete", "Backspace"], paints: true, shown: "Delete", what: words.erase, run: () => modes.tool.erase() },
      { names: ["f"], paints: true, what: words.similar, run: () => void workbench.fillSimilar() },
      { names: ["Ctrl+z"], what: words.undo, run: () => void workbench.session.undo() },
      { names: ["Ctrl+Shift+z", "Ctrl+y"], shown: "Ctrl+Shift+Z", what: words.redo, run: () => void workbench.session.redo() },
    ];
  }

  private objects(): Key[] {
    const { workbench } = this;
    return [
      { names: ["o"], what: words.newObject, run: () => workbench.newObject() },
      { names: ["m"], what: words.merge, run: () => workbench.mergeObject(workbench.hoveredPaint) },
      { names: ["Shift+o"], what: words.alone, run: () => workbench.isolatePaint(workbench.hoveredPaint || workbench.currentPaint) },
      { names: ["k"], what: words.lock, run: () => workbench.lock() },
    ];
  }

  private saySaved(): void {
    const { session } = this.workbench;
    this.workbench.say(text.session.savedIn(savedText(session), session.state.work));
  }

  private sections(): Key[] {
    const { clip } = this.parts;
    return [
      ...["x", "y", "z"].map((name, axis) => ({
        names: [`Alt+${name}`], shown: axis ? "" : words.sectionKeys, what: words.section,
        run: () => clip.cycle(axis),
      })),
      { names: ["c"], what: words.clip, run: () => clip.toggle() },
      { names: [".", ">"], shown: words.nudgeKeys, what: words.nudge, run: () => clip.nudge(1) },
      { names: [",", "<"], shown: "", what: "", run: () => clip.nudge(-1) },
    ];
  }

  private classKey(key: string): Key {
    return {
      names: [key],
      shown: key === "1" ? "1 … 9" : "",
      what: words.classKey,
      run: () => {
        const id = this.workbench.classKeys.classOf(key);
        if (!id) return this.workbench.say(words.noClassHasKey(key));
        this.workbench.choose(id);
        this.workbench.drawing.canvas.focus();
        this.workbench.sayChosen();
      },
    };
  }

  private regions(): Key[] {
    const { workbench, parts: { modes } } = this;
    return [
      { names: ["n"], what: words.nextRegion, run: () => workbench.moveCursor(1) },
      { names: ["p"], what: words.previousRegion, run: () => workbench.moveCursor(-1) },
      { names: ["s"], what: words.nextUnlabeled, run: () => workbench.showNextBare() },
      { names: ["Shift+s"], what: words.blink, run: () => workbench.blinkBare() },
      { names: ["Shift+u"], what: words.hideLabeled, run: () => workbench.hideLabeled() },
      { names: ["+", "=", "]"], shown: words.growKeys, what: words.grow, run: () => modes.tool.resize(true) },
      { names: ["-", "["], shown: words.shrinkKeys, what: words.shrink, run: () => modes.tool.resize(false) },
      { names: ["h"], what: words.hide, run: () => workbench.hideActive() },
      { names: ["Shift+h"], what: words.isolate, run: () => workbench.isolateActive() },
      { names: ["u", "Alt+h"], shown: "U", what: words.showAll, run: () => workbench.showAll() },
    ];
  }

  private modeKeys(): Key[] {
    const { modes } = this.parts;
    return [
      { names: ["v", "Escape"], shown: words.paintModeKeys, what: words.paintMode, run: () => this.leave() },
      { names: ["b"], what: words.brush, run: () => modes.nextBrush() },
      { names: [], shown: words.cellKeys, what: words.cells, run: () => undefined },
      { names: ["l"], what: words.lasso, run: () => modes.nextLasso() },
      { names: ["Shift+l"], what: words.outline, run: () => modes.nextOutline() },
      { names: ["x"], what: words.split, run: () => modes.choose("split") },
      { names: ["Shift+x"], what: words.divide, run: () => void this.workbench.refineActive() },
      { names: ["?", "F1"], what: words.help, run: () => this.openHelp() },
    ];
  }

  private view(): Key[] {
    const { modes, views, walk } = this.parts;
    const { camera } = this.workbench.drawing;
    const arrows = (prefix: string, all: string, what: string, go: (x: number, y: number) => void): Key[] =>
      ARROWS.map(([name, x, y], i) => ({
        names: [`${prefix}Arrow${name}`], shown: i ? "" : all, what, run: () => go(x, y),
      }));
    return [
      ...arrows("", words.arrows, words.turn, (x, y) => modes.tool.arrow(x, -y)),
      ...arrows("Shift+", words.shiftArrows, words.move, (x, y) => camera.pan(0.05 * x, 0.05 * y)),
      { names: ["i"], what: words.zoomIn, run: () => camera.zoomBy(1.25) },
      { names: ["Shift+i"], what: words.zoomOut, run: () => camera.zoomBy(0.8) },
      ...views.keys(),
      { names: ["q"], what: words.walk, run: () => walk.toggle() },
      ...TURNS.map(([digit, x, y]) => ({ names: [`Numpad${digit}`], shown: "", what: "", run: () => camera.orbit(x, y) })),
      { names: ["Numpad5"], shown: "", what: "", run: () => this.workbench.say(text.mouse.noParallel) },
    ];
  }

  private textureKey(): Key {
    const { workbench: { drawing: { blend } }, parts: { comparison } } = this;
    const run = (): void => {
      if (comparison.isOpen) void comparison.settle("theirs");
      else if (!blend.toggle()) this.workbench.say(text.views.noTexture);
    };
    return { names: ["t"], what: words.texture, run };
  }

  private leave(): void {
    this.parts.modes.choose("paint");
    this.workbench.clearSelection();
  }

  private pressed(event: KeyboardEvent): void {
    const target = event.target as Element;
    if (document.querySelector("dialog[open]") || !this.workbench.session.paints || target.closest(FIELDS)) return;
    if (this.parts.walk.press(event)) return event.preventDefault();
    const isBlender = this.scheme.value === "blender";
    // In Blender, digits of the number pad change the view, so here they must not choose classes. Ctrl with + is the browser's.
    const isPlain = !event.ctrlKey && !event.metaKey && !event.altKey;
    const isNumpad = isBlender && isPlain && /^Numpad(\d|Add|Subtract|Decimal|Divide)$/.test(event.code);
    const key = this.table.get(isNumpad ? NUMPAD[event.code] ?? event.code : nameOf(event));
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
    this.workbench.say(text.painting.nowhere);
  }

  private openHelp(): void {
    const rows = Object.values(this.groups).map((keys) => keys.flatMap(({ names, shown = names[0], what }) => {
      if (!shown) return [];
      const how = shown.length === 1 ? shown.toUpperCase() : shown.replace(/\+([a-z])$/, (_, letter: string) => `+${letter.toUpperCase()}`);
      return [[how, what]];
    }));
    const mouse = [...text.mouse.schemes[this.scheme.value as Scheme].rows, ...text.mouse.commonRows];
    const titles = [text.help.mouse, ...Object.keys(this.groups)];
    const sections = [mouse, ...rows].map((list, i) => make("section", {},
      make("h3", {}, titles[i]),
      make("dl", {}, ...list.flatMap(([how, what]) => [make("dt", {}, make("kbd", {}, how)), make("dd", {}, what)])),
    ));
    element("help-keys").replaceChildren(...sections);
    this.help.showModal();
  }
}

const RETURNING = "#next-bare, #new-object, #views button, #classes :is([type=radio], kbd, .none, output)";

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
