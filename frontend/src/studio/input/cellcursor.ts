// Keyboard cursor on a single cell. The arrow keys move the cursor to an adjacent cell.

import { NONE } from "../../shared/shape";
import { dot, lengthOf, minus, normalized, plus, scaled, sphereOf, type Vector } from "../../shared/vectors";
import { MARK_CURSOR } from "../view/celltable";
import type { Workbench } from "../workbench";
import type { Mesh } from "../data/mesh";
import { putCircle } from "../view/picker";
import { text } from "../text/index";

const MIN_COSINE = 0.25; // smallest cosine of the angle between the direction of an arrow key and the direction to the next cell
// If the cursor is closer than this to the edge of the canvas, relative to the canvas size, the camera moves.
const MARGIN = 0.1;
// A cell faces the camera if the cosine of the angle between its normal and the direction to the eye is larger.
const MIN_FACING = 0.35;
const STAND_OFF = 60; // largest distance from the eye to the cell after `fly`, in multiples of the cell's radius

const words = text.cellCursor;

export class CellCursor {
  cell = -1;

  constructor(private readonly workbench: Workbench, private readonly ring: SVGCircleElement) {
    workbench.session.events.on("file", () => {
      this.cell = -1;
      this.showRing();
    });
    workbench.events.on("selection", () => this.clear());
    workbench.drawing.afterDraw.push(() => this.showRing());
  }

  private get mesh(): Mesh {
    return this.workbench.session.mesh;
  }

  clear(): void {
    if (this.cell < 0) return;
    this.workbench.drawing.cells.mark([this.cell], MARK_CURSOR, false);
    this.cell = -1;
  }

  /**
   * Move the cursor to the neighbor in a direction: x is 1 for right and -1 for left, y is 1 for up and
   * -1 for down. If the cursor is on no cell, or its cell is hidden, move it to the cell that `start` returns.
   */
  move(x: number, y: number): void {
    const isFirst = this.cell < 0 || this.workbench.isHidden(this.cell);
    const next = isFirst ? this.start() : this.next(x, y);
    if (next >= 0) this.go(next, isFirst);
    else this.workbench.say(isFirst ? words.noneVisible : words.noneThere(this.mesh.oneCell));
  }

  private go(cell: number, isFirst: boolean): void {
    const { workbench } = this;
    this.clear();
    this.cell = cell;
    workbench.takeFocus();
    workbench.hover(-1);
    workbench.drawing.cells.mark([cell], MARK_CURSOR, true);
    if (isFirst || !this.isWellSeen(cell)) this.fly(cell);
    const region = workbench.regionOf(cell);
    const paint = workbench.paintName(workbench.session.paints.of[cell]);
    workbench.say(region < 0 ? words.inNoRegion(this.name, paint) : words.inRegion(this.name, region, paint));
  }

  private get name(): string {
    return text.cell(this.mesh.oneCell, this.cell);
  }

  /** Give the cell at the cursor the class and object encoded by `paint`; 0 removes class and object. */
  paint(paint: number): void {
    this.workbench.session.paint(Uint32Array.of(this.cell), paint);
    this.workbench.sayPainted(this.name, paint);
  }

  /**
   * The cell at which the cell cursor starts: the cell in the middle of the region selected by keyboard or, if no
   * region is selected, the visible cell nearest to the middle of the canvas; -1 if there is none.
   */
  private start(): number {
    const { cursor, session, picker } = this.workbench;
    if (cursor >= 0) return this.middleCell(session.regions.cellsOf(cursor));
    const seen = picker.cellsSeen();
    let best = -1;
    let least = Infinity;
    seen.cells.forEach((cell, i) => {
      if (cell === NONE) return;
      const column = (i % seen.width) - seen.width / 2;
      const row = Math.floor(i / seen.width) - seen.height / 2;
      const off = column * column + row * row;
      if (off < least) [best, least] = [cell, off];
    });
    return best;
  }

  private middleCell(cells: Uint32Array): number {
    const shown = [...cells].filter((cell) => this.mesh.middleOf(cell) && !this.workbench.isHidden(cell));
    const middles = shown.map((cell) => this.mesh.middleOf(cell)!);
    const middle = sphereOf(middles)?.middle;
    const off = middles.map((at) => lengthOf(minus(at, middle!)));
    const best = off.reduce((least, distance, i) => (distance < off[least] ? i : least), 0);
    return shown[best] ?? -1;
  }

  private next(x: number, y: number): number {
    const { mesh, workbench } = this;
    const [right, up] = workbench.drawing.camera.directions();
    const way = plus(scaled(right, x), up, y);
    const from = mesh.middleOf(this.cell)!;
    let best = -1;
    let most = 0;
    for (const cell of workbench.picker.surroundings.around(this.cell)) {
      const middle = mesh.middleOf(cell);
      if (cell === this.cell || workbench.isHidden(cell) || !middle) continue;
      const step = minus(middle, from);
      const distance = lengthOf(step);
      const cosine = distance > 0 ? dot(step, way) / distance : 0;
      const worth = mesh.isCloud ? cosine / distance : cosine;
      if (cosine >= MIN_COSINE && worth > most) [best, most] = [cell, worth];
    }
    return best;
  }

  private isWellSeen(cell: number): boolean {
    const { drawing, picker } = this.workbench;
    const place = picker.placeOf(cell);
    if (!place) return false;
    const { clientWidth, clientHeight } = drawing.canvas;
    const [x, y] = [place.x / clientWidth, place.y / clientHeight];
    if (Math.min(x, y, 1 - x, 1 - y) < MARGIN) return false;
    return this.isFacing(cell, place);
  }

  /** Whether a cell is visible at its place on the canvas, and faces the camera. */
  private isFacing(cell: number, place = this.workbench.picker.placeOf(cell)): boolean {
    const normal = normalized(this.mesh.normalOf(cell));
    const toward = this.workbench.drawing.camera.directions()[2];
    const isFront = lengthOf(normal) === 0 || dot(normal, toward) > MIN_FACING;
    return isFront && place !== null && this.workbench.picker.cellAt(place) === cell;
  }

  /** Move the camera close to the cell. If the cell is visible and faces the camera, the viewing direction is kept. */
  private fly(cell: number): void {
    const { mesh } = this;
    const middle = mesh.middleOf(cell)!;
    const corners = mesh.cornersOf(cell);
    const radius = corners ? lengthOf(minus(corners[0], middle)) : mesh.shape.facts.point_size;
    const { drawing } = this.workbench;
    const normal: Vector = this.isFacing(cell) ? [0, 0, 0] : mesh.normalOf(cell);
    drawing.camera.fly(middle, normal, Math.min(drawing.camera.distance, STAND_OFF * radius));
  }

  private showRing(): void {
    putCircle(this.ring, this.cell < 0 ? null : this.workbench.picker.placeOf(this.cell));
  }
}
