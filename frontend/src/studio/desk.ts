// State that tools, keys and panels share: open file, selection, current class.

import { lengthOf, minus, plus, scaled, type Vector } from "../shared/vectors";
import { MARK_HIDDEN } from "./celltable";
import { parseColor, regionColors } from "./colors";
import type { ClassEntry } from "./contract";
import type { Drawing } from "./drawing";
import { Events } from "./events";
import { Picker } from "./picking";
import type { Session } from "./session";

interface Kinds {
  class: number;
  selection: ReadonlySet<number>;
  hover: number; // cell under the pointer; -1 for none
}

const nameOf = (regions: readonly number[]): string =>
  regions.length === 1 ? `Region ${regions[0]}` : `${regions.length} regions`;

export class Desk {
  readonly events = new Events<Kinds>();
  picker!: Picker;
  currentClass = 0;
  cursor = -1; // region of the keyboard's cursor; -1 for none
  hoveredCell = -1;
  tolerance = 0.15; // tolerance of the operation "similar", 0 to 1
  readonly selection = new Set<number>();
  private isPainted = false; // the last stroke painted the selection
  private order: number[] = []; // order of regions for next and previous

  constructor(readonly session: Session, readonly drawing: Drawing) {
    const { events } = session;
    events.on("file", () => this.takeFile());
    events.on("regions", () => this.takeRegions());
    events.on("classes", (classes) => this.takeClasses(classes));
    events.on("cells", (cells) => {
      drawing.cells.setClasses(session.classes.of, cells);
      drawing.redraw();
    });
  }

  private takeFile(): void {
    const { mesh } = this.session;
    this.drawing.setMesh(mesh);
    this.picker = new Picker(this.drawing, mesh);
  }

  private takeRegions(): void {
    const { regions, mesh } = this.session;
    this.selection.clear();
    this.cursor = -1;
    this.order = regions.neighbors.walk();
    this.drawing.setLabels(regions.labels, regionColors(regions.neighbors, regions.count, mesh.palette));
    this.drawing.mark({ hovered: this.regionOf(this.hoveredCell), cursor: -1 });
    this.events.emit("selection", this.selection);
  }

  private takeClasses(classes: ClassEntry[]): void {
    this.drawing.setClassColors(new Map(classes.map(({ id, color }) => [id, parseColor(color)])));
    if (!classes.some(({ id }) => id === this.currentClass)) this.choose(classes[0]?.id ?? 0);
  }

  choose(id: number): void {
    this.currentClass = id;
    this.events.emit("class", id);
  }

  className(id: number): string {
    return this.session.state.classes.find((entry) => entry.id === id)?.name ?? "no class";
  }

  say(line: string): void {
    this.session.events.emit("message", line);
  }

  regionOf(cell: number): number {
    return cell < 0 || !this.session.regions ? -1 : this.session.regions.labels[cell];
  }

  hover(cell: number): void {
    this.hoveredCell = cell;
    this.drawing.mark({ hovered: this.regionOf(cell) });
    this.events.emit("hover", cell);
  }

  /** The region that keys act on: the one under the pointer, or else under the cursor. */
  get activeRegion(): number {
    const hovered = this.regionOf(this.hoveredCell);
    return hovered >= 0 ? hovered : this.cursor;
  }

  select(regions: Iterable<number>, isPainted: boolean): void {
    this.drawing.select(this.selection, false);
    this.selection.clear();
    for (const region of regions) this.selection.add(region);
    this.isPainted = isPainted;
    if (!isPainted) this.drawing.select(this.selection, true);
    this.events.emit("selection", this.selection);
  }

  /** Clear the selection made by keys. */
  clearSelection(): void {
    this.cursor = -1;
    this.drawing.mark({ cursor: -1 });
    this.select([], false);
  }

  /** Paint regions, and select them for growing and shrinking. */
  paintRegions(regions: Iterable<number>, id: number): void {
    const list = [...regions];
    if (!list.length) return;
    this.session.paint(this.session.regions.cellsOfAll(list), id);
    this.select(list, true);
  }

  moveCursor(steps: number): void {
    const count = this.order.length;
    if (!count) return;
    let at = this.cursor < 0 ? (steps > 0 ? -1 : 0) : this.order.indexOf(this.cursor);
    for (let i = 0; i < count; i++) {
      at = (at + steps + count) % count;
      if (!this.isRegionHidden(this.order[at])) break;
    }
    this.setCursor(this.order[at]);
  }

  setCursor(region: number): void {
    this.cursor = region;
    this.hover(-1);
    this.select([region], false);
    this.drawing.mark({ cursor: region });
    const where = this.fly(region) ? "" : " (inside the body)";
    const { regions, classes, mesh } = this.session;
    const share = (100 * regions.areas[region]) / classes.totalArea;
    const id = classes.mainClass(regions.cellsOf(region));
    this.say(`Region ${region}${where}: ${share.toPrecision(2)} % of the ${mesh.measure}, ${this.className(id)}.`);
  }

  /** Fly to a region; false if it is hidden inside the body. */
  private fly(region: number): boolean {
    const { mesh, regions } = this.session;
    let [sum, normal]: [Vector, Vector] = [[0, 0, 0], [0, 0, 0]];
    const middles: Vector[] = [];
    for (const cell of regions.cellsOf(region)) {
      const middle = mesh.middleOf(cell);
      if (!middle) continue;
      middles.push(middle);
      sum = plus(sum, middle);
      normal = plus(normal, mesh.normalOf(cell));
    }
    if (!middles.length) return false;
    const place = scaled(sum, 1 / middles.length);
    const reach = middles.reduce((most, middle) => Math.max(most, lengthOf(minus(middle, place))), 0);
    const { camera } = this.drawing;
    camera.fly(place, normal, Math.max(12 * reach, 0.3 * camera.size));
    return true;
  }

  /** Paint the selection, or the region under pointer or cursor. */
  paintActive(id: number): void {
    const { activeRegion } = this;
    const list = this.selection.size && !this.isPainted ? [...this.selection] : [activeRegion];
    if (list[0] < 0) {
      this.say("No region is chosen: N goes to the next one.");
      return;
    }
    this.session.paint(this.session.regions.cellsOfAll(list), id);
    this.sayPainted(list, id);
  }

  /** Announce the class that regions, or cells, have now. */
  sayPainted(what: readonly number[] | string, id: number): void {
    const name = typeof what === "string" ? what : nameOf(what);
    this.say(id ? `${name}: ${this.className(id)}.` : `${name}: class removed.`);
  }

  /** Go to the largest region that is mostly unlabeled. */
  showLargestBare(): void {
    const { regions, classes } = this.session;
    let best = -1;
    let most = 0;
    for (let region = 0; region < regions.count; region++) {
      if (regions.areas[region] <= most || this.isRegionHidden(region)) continue;
      const bare = classes.bareArea(regions.cellsOf(region));
      if (2 * bare < regions.areas[region] || bare <= most) continue;
      [best, most] = [region, bare];
    }
    if (best < 0) this.say("Every region has a class.");
    else this.setCursor(best);
  }

  grow(): void {
    if (!this.selection.size) return this.say("Nothing is selected, nor painted yet.");
    const { regions, classes } = this.session;
    let ring = regions.neighbors.ringAround(this.selection);
    if (this.isPainted) ring = ring.filter((r) => classes.mainClass(regions.cellsOf(r)) === 0);
    if (!ring.length) return this.say("There is nothing around to grow into.");
    const painted = classes.mainClass(regions.cellsOfAll(this.selection));
    if (this.isPainted) this.session.paint(regions.cellsOfAll(ring), painted);
    this.select([...this.selection, ...ring], this.isPainted);
    this.say(`Grown by ${ring.length} regions.`);
  }

  shrink(): void {
    const { regions } = this.session;
    const ring = regions.neighbors.outerRing(this.selection);
    if (!ring.length || ring.length === this.selection.size) {
      return this.say("There is no ring to take away.");
    }
    if (this.isPainted) this.session.paint(regions.cellsOfAll(ring), 0);
    const rest = [...this.selection].filter((region) => !ring.includes(region));
    this.select(rest, this.isPainted);
    this.say(`Shrunk by ${ring.length} regions.`);
  }

  async fillSimilar(): Promise<void> {
    const { session, activeRegion } = this;
    if (activeRegion < 0) return this.say("No region is under the pointer or chosen.");
    const like = await session.similar(activeRegion, this.tolerance);
    const { regions, classes } = session;
    const bare = like.filter((region) => classes.mainClass(regions.cellsOf(region)) === 0);
    this.paintRegions(new Set([activeRegion, ...bare]), this.currentClass);
    this.say(`${bare.length + 1} similar regions: ${this.className(this.currentClass)}.`);
  }

  private isRegionHidden(region: number): boolean {
    return this.isHidden(this.session.regions.cellsOf(region)[0]);
  }

  isHidden(cell: number): boolean {
    return this.drawing.cells.isHidden(cell);
  }

  hideActive(): void {
    this.mask(true, "is hidden");
  }

  isolateActive(): void {
    this.mask(false, "alone is shown");
  }

  /** Hide the active region, or all others. */
  private mask(isHidden: boolean, verb: string): void {
    const { activeRegion, session, drawing } = this;
    if (activeRegion < 0) return this.say("No region is under the pointer or chosen.");
    if (!isHidden) drawing.cells.mark(Array(session.mesh.nCells).keys(), MARK_HIDDEN, true);
    drawing.cells.mark(session.regions.cellsOf(activeRegion), MARK_HIDDEN, isHidden);
    this.afterHiding(`Region ${activeRegion} ${verb}; U shows all.`);
  }

  showAll(): void {
    if (!this.drawing.cells.hasHidden) return this.say("Nothing is hidden.");
    this.drawing.cells.unmarkAll(MARK_HIDDEN);
    this.afterHiding("All is shown.");
  }

  private afterHiding(line: string): void {
    this.drawing.changeView();
    this.hover(-1);
    this.say(line);
  }
}
