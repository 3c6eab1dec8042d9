// Tools for the canvas. The current tool handles strokes with the paint button of the mouse.

import type { Place } from "../../shared/picking";
import { NONE } from "../../shared/shape";
import { lengthOf, minus } from "../../shared/vectors";
import type { CellCursor } from "./cellcursor";
import { MARK_BLUE, MARK_RED } from "../view/celltable";
import type { Workbench } from "../workbench";
import { addTo, objectOf, type Regions } from "../data/labeling";
import type { Seen } from "../view/drawing";
import { placesBetween } from "../view/picker";
import { newStrokeId } from "../session/saver";
import { text } from "../text/index";

const words = text.tools;

export abstract class Tool {
  abstract readonly name: string;
  abstract readonly hint: string;
  readonly turnsBeside: boolean = true; // whether a drag that begins outside the mesh rotates the view

  constructor(protected readonly workbench: Workbench) {}

  readonly takesAlt: boolean = false; // whether a stroke with Alt is a stroke of this tool instead of a movement of the view

  /**
   * Begin a stroke. If Shift is held, `withShift` is true: the stroke erases or, in split mode, is blue. If Alt is held and
   * the tool takes it, `isFront` is true.
   */
  abstract begin(place: Place, withShift: boolean, isFront?: boolean): void;
  abstract move(place: Place): void;
  abstract end(): void;
  enter(): void {}
  leave(): void {}

  /** Handle the Enter key. By default, assign the current class and object to the regions that `paintActive` chooses. */
  confirm(): void {
    this.workbench.paintActive(this.workbench.currentPaint);
  }

  /** Handle the Delete key. By default, remove class and object of the regions that `paintActive` chooses. */
  erase(): void {
    this.workbench.paintActive(0);
  }

  /**
   * Handle an arrow key. By default, rotate the view. x is 1 for right and -1 for left, and y is 1 for up and -1 for
   * down.
   */
  arrow(x: number, y: number): void {
    this.workbench.drawing.camera.orbit(TURN * x, -TURN * y);
  }

  /**
   * Handle the keys + (`isUp`) and -. By default, grow or shrink the selected or painted area by one ring of regions.
   */
  resize(isUp: boolean): void {
    if (isUp) this.workbench.grow();
    else this.workbench.shrink();
  }
}

const TURN = 0.15; // rotation of the view by one press of an arrow key, in radians
const STEP = 6; // distance in pixels between the points of a stroke at which cells are looked up

/** A tool that paints along strokes. `touched` contains the regions or cells that the current stroke has painted. */
abstract class Brush extends Tool {
  protected paint = 0; // class and object that the current stroke gives, as one number; 0 removes labels
  protected strokeId = "";
  protected nChanged = 0; // number of cells that the current stroke has changed
  protected readonly touched = new Set<number>();
  protected readonly replaced = new Map<number, number>(); // number of repainted regions, keyed by their previous class and object
  private last: Place = { x: 0, y: 0 };

  /** Distance in pixels between the points of a stroke at which cells are looked up. */
  protected get step(): number {
    return STEP;
  }

  protected abstract touch(place: Place): void;

  begin(place: Place, withShift: boolean): void {
    this.paint = withShift ? 0 : this.workbench.currentPaint;
    this.last = place;
    this.strokeId = newStrokeId();
    this.nChanged = 0;
    this.touched.clear();
    this.replaced.clear();
    this.touch(place);
  }

  move(place: Place): void {
    for (const between of placesBetween(this.last, place, this.step)) this.touch(between);
    this.last = place;
  }
}

/** Paints the regions under the pointer. */
export class RegionBrush extends Brush {
  readonly name = words.paintName;
  readonly hint = words.paintHint;
  private regions: Regions | null = null; // regions whose numbers `touched` contains

  protected touch(place: Place): void {
    const { workbench } = this;
    const cell = workbench.picker.cellAt(place);
    const region = workbench.regionOf(cell);
    const { regions } = workbench.session;
    if (regions !== this.regions) this.touched.clear(); // other regions have these numbers now
    this.regions = regions;
    if (region >= 0 && !this.touched.has(region)) {
      this.touched.add(region);
      workbench.countReplaced([region], this.paint, this.replaced);
      this.nChanged += workbench.session.paint(workbench.session.regions.cellsOf(region), this.paint, this.strokeId);
    }
    workbench.hover(cell);
  }

  end(): void {
    const { workbench } = this;
    if (!this.touched.size || this.regions !== workbench.session.regions) return;
    workbench.select(this.touched, true);
    const { paints: { of }, regions } = workbench.session;
    const isAlready = this.paint !== 0 && !this.nChanged && regions.cellsOfAll(this.touched).every((cell) => of[cell] === this.paint);
    if (isAlready) workbench.say(text.painting.already(text.painting.several([...this.touched]), workbench.paintName(this.paint)));
    else workbench.sayPainted([...this.touched], this.paint, this.replaced);
  }
}

/**
 * Paints the single cells inside a circle around the pointer. With `isBall`, paints all cells inside a ball around the cell
 * under the pointer, also those that are not visible.
 */
export class CellBrush extends Brush {
  readonly name: string;
  readonly hint = words.brushHint;
  radius = 16;

  constructor(workbench: Workbench, private readonly circle: SVGCircleElement, private readonly cursor: CellCursor, private readonly isBall: boolean) {
    super(workbench);
    this.name = isBall ? words.ballName : words.brushName;
  }

  override enter(): void {
    this.circle.setAttribute("r", String(this.radius));
    this.circle.removeAttribute("hidden");
  }

  override leave(): void {
    this.circle.setAttribute("hidden", "");
    this.cursor.clear();
  }

  override arrow(x: number, y: number): void {
    this.cursor.move(x, y);
  }

  override confirm(): void {
    this.paintChosen(this.workbench.currentPaint);
  }

  override erase(): void {
    this.paintChosen(0);
  }

  private paintChosen(paint: number): void {
    if (this.cursor.cell >= 0) this.cursor.paint(paint);
    else this.workbench.paintActive(paint);
  }

  override resize(isUp: boolean): void {
    this.radius = Math.min(200, Math.max(2, this.radius * (isUp ? 1.25 : 0.8)));
    this.circle.setAttribute("r", String(this.radius));
    this.workbench.say(words.radius(this.radius));
  }

  protected override get step(): number {
    return Math.max(STEP, this.radius / 2);
  }

  protected touch(place: Place): void {
    const { workbench } = this;
    const around = workbench.picker.cellsAround(place, this.radius, this.isBall);
    const fresh = around.filter((cell) => !this.touched.has(cell));
    for (const cell of fresh) this.touched.add(cell);
    workbench.session.paint(Uint32Array.from(fresh), this.paint, this.strokeId);
  }

  end(): void {
    if (!this.touched.size) return;
    this.workbench.select([], false);
    this.workbench.sayPainted(text.cells(this.touched.size), this.paint);
  }
}

export const OUTLINES = ["lasso", "rectangle", "polygon"] as const;
const CLOSE = 10; // largest distance in pixels to the first or last corner at which a click closes a polygon
const MIN_PIECE = 0.05; // smallest piece that can be the front piece, as a fraction of the pixels inside the outline
const MAX_LOOKED_UP = 16; // largest number of cells of a region that are looked up to find whether it is inside an outline
const NEAR = 4; // largest distance between the middles of neighboring cells of a piece, in multiples of their sizes

/**
 * Paints each region of which at least a quarter is visible, if at least half of the visible part is inside a drawn
 * outline. With `ofCells`, paints the visible cells inside the outline instead. With Alt, only the connected piece of the
 * surface that is nearest to the eye counts.
 */
export class Lasso extends Tool {
  override readonly turnsBeside = false;
  override readonly takesAlt = true;
  outline: (typeof OUTLINES)[number] = "lasso";
  private places: Place[] = [];
  private paint = 0;
  private isFront = false;
  private isWarned = false; // whether the user was warned that the current outline replaces labels

  constructor(workbench: Workbench, private readonly line: SVGPolygonElement, private readonly ofCells: boolean) {
    super(workbench);
    workbench.drawing.onView.push(() => this.drop());
  }

  get name(): string {
    const outline = words.outlines[this.outline];
    return this.ofCells ? words.ofCells(outline) : words.ofRegions(outline);
  }

  get hint(): string {
    return words.lassoHint(words.outlineHints[this.outline]);
  }

  begin(place: Place, withShift: boolean, isFront = false): void {
    const { places } = this;
    if (this.outline === "polygon" && places.length) {
      const isClosed = [places[0], places[places.length - 1]].some(({ x, y }) => Math.hypot(x - place.x, y - place.y) < CLOSE);
      if (isClosed) this.confirm();
      else this.add(place);
      return;
    }
    this.paint = withShift ? 0 : this.workbench.currentPaint;
    [this.isFront, this.isWarned] = [isFront, false];
    this.places = [place];
  }

  move(place: Place): void {
    if (this.outline !== "polygon") this.add(place);
  }

  private add(place: Place): void {
    const [{ x, y }] = this.places;
    if (this.outline === "rectangle") this.places = [{ x, y }, { x: place.x, y }, place, { x, y: place.y }];
    else this.places.push(place);
    this.draw();
    const warning = this.isWarned ? "" : this.workbench.harmAt(this.workbench.picker.cellAt(place), this.paint);
    if (warning) this.workbench.say(text.painting.outline(warning));
    this.isWarned ||= warning !== "";
  }

  private draw(): void {
    this.line.setAttribute("points", this.places.map(({ x, y }) => `${x},${y}`).join(" "));
  }

  override leave(): void {
    this.places = [];
    this.draw();
  }

  /** Remove an unfinished outline after a change of the view: other cells are inside it now. */
  private drop(): void {
    if (!this.places.length) return;
    this.leave();
    this.workbench.say(text.painting.outlineDropped);
  }

  /** Close a polygon; otherwise, do what Enter does for all tools. */
  override confirm(): void {
    if (this.outline !== "polygon" || !this.places.length) super.confirm();
    else if (this.places.length > 2) this.close();
    else this.workbench.say(text.painting.threeCorners);
  }

  end(): void {
    if (this.outline !== "polygon") this.close();
    else this.draw();
  }

  private close(): void {
    const outline = this.places;
    const seen = this.workbench.picker.cellsSeen();
    const all = this.countInside(seen);
    this.leave();
    if (outline.length < 3) return;
    const inside = this.isFront ? this.frontPiece(all, seen) : all;
    if (this.ofCells) this.paintCells(inside);
    else this.paintRegions(inside, seen, outline);
  }

  /** Number of pixels of each visible cell that are inside the outline. */
  private countInside(seen: Seen): Map<number, number> {
    const counts = new Map<number, number>();
    for (let row = 0; row < seen.height; row++) {
      const y = (seen.height - row - 0.5) / seen.scale;
      const crossings = crossingsOf(this.places, y);
      for (let k = 0; k + 1 < crossings.length; k += 2) {
        const first = Math.max(0, Math.ceil(crossings[k] * seen.scale - 0.5));
        const last = Math.min(seen.width, Math.ceil(crossings[k + 1] * seen.scale - 0.5));
        for (let column = first; column < last; column++) {
          const cell = seen.cells[row * seen.width + column];
          if (cell !== NONE) addTo(counts, cell, 1);
        }
      }
    }
    return counts;
  }

  /** The connected piece of the cells inside the outline that is nearest to the eye, except small pieces. */
  private frontPiece(inside: Map<number, number>, { cells, width }: Seen): Map<number, number> {
    const { drawing: { camera, canvas }, session: { mesh } } = this.workbench;
    const pixel = camera.distance / camera.pixelsOf(canvas.clientHeight);
    const sizeOf = (cell: number): number => pixel + (mesh.isCloud ? mesh.shape.facts.point_size : Math.sqrt(mesh.areas[cell]));
    const pieces = new Pieces(inside.keys());
    const join = (cell: number, other: number): void => {
      if (cell === other || !inside.has(cell) || !inside.has(other) || pieces.of(cell) === pieces.of(other)) return;
      const step = lengthOf(minus(mesh.middleOf(cell)!, mesh.middleOf(other)!));
      if (step <= NEAR * (sizeOf(cell) + sizeOf(other))) pieces.join(cell, other);
    };
    cells.forEach((cell, i) => {
      if ((i + 1) % width) join(cell, cells[i + 1]);
      if (i >= width) join(cell, cells[i - width]);
    });
    const [counts, depths] = [new Map<number, number>(), new Map<number, number>()];
    const depthOf = camera.depths;
    let total = 0;
    for (const [cell, count] of inside) {
      const piece = pieces.of(cell);
      addTo(counts, piece, count);
      depths.set(piece, Math.min(depths.get(piece) ?? Infinity, depthOf(mesh.middleOf(cell)!)));
      total += count;
    }
    const large = [...counts.keys()].filter((piece) => counts.get(piece)! >= MIN_PIECE * total);
    const front = large.reduce((best, piece) => (depths.get(piece)! < depths.get(best)! ? piece : best), large[0]);
    return new Map([...inside].filter(([cell]) => pieces.of(cell) === front));
  }

  private paintCells(inside: Map<number, number>): void {
    this.workbench.session.paint(Uint32Array.from(inside.keys()).sort(), this.paint);
    this.workbench.sayPainted(text.cells(inside.size), this.paint);
  }

  private paintRegions(inside: Map<number, number>, seen: Seen, outline: Place[]): void {
    const { workbench } = this;
    const total = new Map<number, number>();
    for (const cell of seen.cells) {
      if (cell !== NONE) addTo(total, workbench.regionOf(cell), 1);
    }
    const enclosed = new Map<number, number>();
    for (const [cell, count] of inside) addTo(enclosed, workbench.regionOf(cell), count);
    const isMostlyInside = (region: number): boolean => region >= 0 && 2 * enclosed.get(region)! >= total.get(region)!;
    const isSeen = this.isSeenIn(seen);
    const chosen = [...enclosed.keys()].filter(isMostlyInside).filter(isSeen);
    const covered = text.painting.leftOut(this.countCovered(outline, isSeen));
    if (!chosen.length) return workbench.say(`${text.painting.noneInside}${covered}`);
    const replaced = new Map<number, number>();
    workbench.countReplaced(chosen, this.paint, replaced);
    workbench.paintRegions(chosen, this.paint);
    const { regions, paints } = workbench.session;
    const painted = chosen.filter((region) => paints.mainPaint(regions.cellsOf(region)) === this.paint);
    const pieces = objectOf(this.paint) ? regions.neighbors.pieces(new Set(painted)).length : 1;
    workbench.sayPainted(painted.length ? painted : chosen, this.paint, replaced, `${text.painting.apart(pieces, this.isFront)}${covered}`);
  }

  /** Number of regions that are mostly inside an outline but not seen. Only some cells of each region are looked up. */
  private countCovered(outline: Place[], isSeen: (region: number) => boolean): number {
    const { workbench, workbench: { picker, drawing: { hidesBacks }, session: { mesh, regions } } } = this;
    const isInside = (cell: number): boolean => {
      const middle = mesh.middleOf(cell);
      if (!middle || workbench.isHidden(cell) || (hidesBacks && workbench.isBack(cell))) return false;
      const place = picker.placeIn(middle);
      return place !== null && crossingsOf(outline, place.y).filter((x) => x < place.x).length % 2 === 1;
    };
    const isMostlyInside = (region: number): boolean => {
      const cells = regions.cellsOf(region);
      const some = cells.filter((_, i) => i % Math.ceil(cells.length / MAX_LOOKED_UP) === 0);
      return 2 * some.filter(isInside).length >= some.length;
    };
    return [...regions.areas.keys()].filter((region) => isMostlyInside(region) && !isSeen(region)).length;
  }

  /**
   * Returns a function that tests whether at least a quarter of a region's surface is visible. A cell is visible if it
   * is drawn, or if the region is drawn at the middle of the cell, because some cells are smaller than a pixel.
   */
  private isSeenIn(seen: Seen): (region: number) => boolean {
    const { picker, session: { regions, mesh } } = this.workbench;
    const drawn = new Set(seen.cells);
    const regionAt = ({ x, y }: Place): number => {
      const row = seen.height - 1 - Math.floor(y * seen.scale);
      return this.workbench.regionOf(seen.cells[row * seen.width + Math.floor(x * seen.scale)]);
    };
    return (region) => {
      let [all, visible] = [0, 0];
      for (const cell of regions.cellsOf(region)) {
        const middle = mesh.middleOf(cell);
        if (!middle) continue;
        all += mesh.areas[cell];
        const place = drawn.has(cell) ? null : picker.placeIn(middle);
        if (drawn.has(cell) || (place && regionAt(place) === region)) visible += mesh.areas[cell];
      }
      return 4 * visible >= all;
    };
  }
}

/** Cells grouped into pieces: a union-find structure. */
class Pieces {
  private readonly parents: Map<number, number>;

  constructor(cells: Iterable<number>) {
    this.parents = new Map([...cells].map((cell) => [cell, cell]));
  }

  /** The cell that identifies the piece of a cell. */
  of(cell: number): number {
    let root = cell;
    while (this.parents.get(root) !== root) root = this.parents.get(root)!;
    this.parents.set(cell, root);
    return root;
  }

  join(cell: number, other: number): void {
    this.parents.set(this.of(cell), this.of(other));
  }
}

/** X coordinates at which a closed polygon crosses the horizontal line at `y`, in ascending order. */
function crossingsOf(places: Place[], y: number): number[] {
  const found: number[] = [];
  places.forEach((a, i) => {
    const b = places[(i + 1) % places.length];
    if (a.y <= y === b.y <= y) return;
    found.push(a.x + ((y - a.y) / (b.y - a.y)) * (b.x - a.x));
  });
  return found.sort((a, b) => a - b);
}

/** Cuts a region in two between a red and a blue stroke. */
export class Splitter extends Tool {
  readonly name = words.splitName;
  readonly hint = words.splitHint;
  private last: Place = { x: 0, y: 0 };
  private region = -1;
  private isBlue = false;
  private readonly red = new Set<number>();
  private readonly blue = new Set<number>();

  override enter(): void {
    this.clear();
  }

  override leave(): void {
    this.clear();
  }

  private clear(): void {
    this.red.clear();
    this.blue.clear();
    this.region = -1;
    this.workbench.drawing.cells.unmarkAll(MARK_RED | MARK_BLUE);
  }

  begin(place: Place, withShift: boolean): void {
    this.isBlue = withShift;
    this.last = place;
    const region = this.workbench.regionOf(this.workbench.picker.cellAt(place));
    if (this.region < 0) this.region = region;
    this.touch(place);
  }

  move(place: Place): void {
    for (const between of placesBetween(this.last, place, 3)) this.touch(between);
    this.last = place;
  }

  private touch(place: Place): void {
    const cell = this.workbench.picker.cellAt(place);
    if (cell < 0 || this.workbench.regionOf(cell) !== this.region) return;
    const [into, from] = this.isBlue ? [this.blue, this.red] : [this.red, this.blue];
    if (from.has(cell)) return;
    into.add(cell);
    const bits = this.isBlue ? MARK_BLUE : MARK_RED;
    this.workbench.drawing.cells.mark([cell], bits, true);
  }

  end(): void {
    const { red, blue, isBlue, workbench } = this;
    const isDrawn = (isBlue ? blue : red).size > 0;
    if (red.size && blue.size) workbench.say(words.enterCuts);
    else if (isDrawn) workbench.say(isBlue ? words.drawRed : words.drawBlue);
    else if (this.region >= 0) workbench.say(words.bothInside(this.region));
  }

  override confirm(): void {
    const { workbench } = this;
    if (!this.red.size && !this.blue.size) this.takeEnds(workbench.activeRegion);
    if (!this.red.size || !this.blue.size) return workbench.say(words.needsStrokes);
    const region = this.region;
    const [red, blue] = [[...this.red], [...this.blue]];
    this.clear();
    void workbench.session.split(region, red, blue).then((done) => {
      if (done) workbench.say(words.isCut(region));
    });
  }

  /** Use two distant cells of the region instead of strokes, for users without a mouse. */
  private takeEnds(region: number): void {
    if (region < 0) return;
    const cells = this.workbench.session.regions.cellsOf(region);
    const seen = cells.filter((cell) => this.workbench.session.mesh.middleOf(cell));
    const isInside = seen.length < 2; // at most one cell is on the surface, so any two cells are used
    const one = isInside ? cells[0] : this.farthestFrom(seen, seen[0]);
    const other = isInside ? cells[cells.length - 1] : this.farthestFrom(seen, one);
    if (one === other) return;
    this.region = region;
    this.red.add(one);
    this.blue.add(other);
  }

  private farthestFrom(cells: Uint32Array, start: number): number {
    const { mesh } = this.workbench.session;
    const from = mesh.middleOf(start);
    const distanceTo = (cell: number): number => (from ? lengthOf(minus(mesh.middleOf(cell) ?? from, from)) : 0);
    return cells.reduce((best, cell) => (distanceTo(cell) > distanceTo(best) ? cell : best), start);
  }
}
