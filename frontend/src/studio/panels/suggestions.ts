// Panel with a list of suggested objects by decreasing score, and buttons that accept and reject suggestions.

import { allow, element, make, onClick } from "../../shared/dom";
import { cssColor, parseColor, type Rgb } from "../data/colors";
import type { SuggestionEntry } from "../data/contract";
import type { Workbench } from "../workbench";
import { classOf, Groups } from "../data/labeling";
import { byScore, type Suggested } from "../data/suggested";
import { text } from "../text/index";

const MAX_LISTED = 200; // largest number of suggestions in the list
const words = text.suggestions;
const UNNAMED: Rgb = [128, 96, 200]; // color of suggestions without a class

export class Suggestions {
  private order: number[] = []; // 1-based indices of the suggestions, by decreasing score
  private cells = new Groups(new Uint32Array(0), 1); // cells of each suggestion, by the 1-based index of the suggestion
  private chosenId: number | null = null; // id of the chosen suggestion, which may have been settled since
  private nSettling = 0; // number of calls of `settle` that the server has not answered
  private isAhead = false; // whether accepting or rejecting has chosen the suggestion, so `next` has yet to visit it
  private readonly list = element("suggestions");
  private readonly least = element<HTMLInputElement>("least-score");

  constructor(private readonly workbench: Workbench) {
    workbench.session.events.on("suggestions", (suggested) => this.take(suggested));
    workbench.session.events.on("classes", () => this.show());
    workbench.events.on("current-paint", () => this.showControls());
    onClick("accept", () => this.accept());
    onClick("reject", () => this.reject());
    onClick("next-suggestion", () => this.next());
    onClick("accept-all", () => void this.settle(this.goodEnough, true));
    this.least.addEventListener("input", () => this.showControls());
  }

  private get entries(): SuggestionEntry[] {
    return this.workbench.session.suggested.entries;
  }

  /** 1-based index of the chosen suggestion; 0 if there is none. */
  private get chosen(): number {
    return 1 + this.entries.findIndex(({ id }) => id === this.chosenId);
  }

  private take(suggested: Suggested): void {
    this.order = byScore(suggested);
    this.cells = new Groups(suggested.owners, suggested.entries.length + 1);
    if (!this.nSettling) [this.chosenId, this.isAhead] = [null, false];
    this.workbench.drawing.setSuggestions(suggested.owners);
    this.show();
  }

  private show(): void {
    const { order, entries } = this;
    element("suggestions-section").hidden = !order.length;
    element("suggestions-count").textContent = String(order.length);
    const rows = order.slice(0, MAX_LISTED).map((place) => this.row(place));
    const nMore = order.length - rows.length;
    this.list.replaceChildren(...rows, ...(nMore ? [make("li", { class: "quiet" }, words.more(nMore))] : []));
    this.workbench.drawing.setSuggestionColors(entries.map((entry) => this.colorOf(entry)), this.chosen);
    this.showControls();
  }

  private row(place: number): HTMLLIElement {
    const entry = this.entries[place - 1];
    const swatch = make("i");
    swatch.style.background = cssColor(this.colorOf(entry));
    const { score, n_cells: n } = entry;
    const { cellName } = this.workbench.session.mesh;
    const title = score === null ? words.sizeTip(cellName) : words.sizeAndScoreTip(cellName);
    const size = score === null ? words.size(n) : words.sizeAndScore(n, score);
    const button = make("button", { type: "button", title }, swatch, make("span", {}, this.nameOf(entry)), make("output", {}, size));
    button.ariaCurrent = String(place === this.chosen);
    button.addEventListener("click", () => this.choose(place));
    return make("li", {}, button);
  }

  private colorOf(entry: SuggestionEntry): Rgb {
    const own = this.workbench.session.state.classes.find(({ id }) => id === entry.class);
    return own ? parseColor(own.color) : UNNAMED;
  }

  private nameOf(entry: SuggestionEntry): string {
    return entry.class ? this.workbench.className(entry.class) : words.noClass;
  }

  /** Suggestions whose score is at least the value of the slider, and all suggestions without a score. */
  private get goodEnough(): number[] {
    const least = Number(this.least.value);
    return this.order.filter((place) => (this.entries[place - 1].score ?? 1) >= least);
  }

  private showControls(): void {
    const places = this.goodEnough;
    const isUsable = places.every((place) => this.classFor(place, false));
    element("least-score-text").textContent = Number(this.least.value) ? this.least.value : words.anyScore;
    element("accept-all").textContent = words.acceptAll(places.length);
    allow(element("accept-all"), places.length > 0 && isUsable, words.acceptAllTip, places.length ? words.someHaveNoClass : words.noneHasScore);
  }

  /**
   * Class that a suggestion would get: the chosen class if `isChosenClass` or if the suggestion has no class, otherwise
   * the class of the suggestion.
   */
  private classFor(place: number, isChosenClass: boolean): number {
    const own = isChosenClass ? 0 : this.entries[place - 1].class;
    return own || classOf(this.workbench.currentPaint);
  }

  /** The suggestion under the pointer or, if there is none, the chosen suggestion. */
  private get active(): number {
    const { hoveredCell, hoveredPaint, session } = this.workbench;
    const hovered = hoveredCell < 0 || hoveredPaint ? 0 : session.suggested.owners[hoveredCell];
    return hovered || this.chosen;
  }

  /**
   * Go to the suggestion with the next lower score, or from the last one to the first. A suggestion that `settle` has
   * chosen is visited first.
   */
  next(): void {
    if (!this.order.length) return this.workbench.say(words.none);
    const step = this.isAhead ? 0 : 1;
    this.choose(this.order[(this.order.indexOf(this.chosen) + step) % this.order.length]);
  }

  private choose(place: number): void {
    this.chosenId = this.entries[place - 1].id;
    this.isAhead = false;
    this.show();
    this.list.children[this.order.indexOf(place)]?.scrollIntoView({ block: "nearest" });
    this.workbench.hover(-1);
    this.workbench.fly(this.cells.of(place));
    this.workbench.say(words.chosen(this.told(place)));
  }

  /** Name and score of a suggestion. */
  private told(place: number): string {
    const entry = this.entries[place - 1];
    return entry.score === null ? this.nameOf(entry) : words.scored(this.nameOf(entry), entry.score);
  }

  /** Accept the active suggestion as an object of its class or, if `isChosenClass`, of the chosen class. */
  accept(isChosenClass = false): void {
    const { active } = this;
    if (!active) return this.workbench.say(this.order.length ? words.noneActive : words.none);
    if (!this.classFor(active, isChosenClass)) return this.workbench.say(words.hasNoClass);
    void this.settle([active], true, isChosenClass);
  }

  reject(): void {
    if (this.active) void this.settle([this.active], false);
    else this.workbench.say(this.order.length ? words.noneActive : words.none);
  }

  /** Accept or reject suggestions. If the chosen suggestion is among them, choose the next one and say so. */
  private async settle(places: number[], isAccepted: boolean, isChosenClass = false): Promise<void> {
    const { workbench, entries } = this;
    const ids = places.map((place) => entries[place - 1].id);
    const pairs = places.map((place, i): [number, number] => [ids[i], this.classFor(place, isChosenClass)]);
    const names = text.list([...new Set(pairs.map(([, id]) => workbench.className(id)))]);
    const isMoved = places.includes(this.chosen);
    const rest = this.order.slice(this.order.indexOf(this.chosen) + 1).filter((place) => !places.includes(place));
    const nextId = entries[rest[0] - 1]?.id;
    this.nSettling++;
    const isDone = await workbench.session.settle(isAccepted ? pairs : [], isAccepted ? [] : ids);
    this.nSettling--;
    if (!isDone) return;
    const isFree = isMoved && !this.chosen; // false if the user has chosen another suggestion in the meantime
    const next = isFree ? 1 + this.entries.findIndex(({ id }) => id === nextId) : 0;
    if (next) this.choose(next);
    this.isAhead = this.chosen > 0 && (next > 0 || this.isAhead);
    this.show();
    const [n, nLeft] = [places.length, this.order.length];
    const done = isAccepted ? words.accepted(n, names, nLeft) : words.rejected(n, nLeft);
    workbench.say(next ? `${done} ${words.next(this.told(next))}` : done);
  }
}
