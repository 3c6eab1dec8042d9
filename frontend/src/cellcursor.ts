// The keyboard's cursor on single cells: arrow keys go from one to the next.

import { Vector3 } from "three";
import type { Desk } from "./desk";
import { NOT_SEEN } from "./drawing";
import { Groups } from "./groups";
import type { Mesh } from "./mesh";
import { MARK_CURSOR } from "./textures";

const LEAST_COSINE = 0.25; // between an arrow key and the way to a neighbor
const MARGIN = 0.1; // of the picture, where the cursor is brought back to the middle
const LEAST_FACING = 0.35; // cosine between the cell's normal and the way to the eye
const STAND_OFF = 60; // radii of a cell that the eye is away from it

const capital = (word: string): string => word[0].toUpperCase() + word.slice(1);

export class CellCursor {
  cell = -1;
  private near: Nearby | null = null;

  constructor(
    private readonly desk: Desk,
    private readonly ring: SVGCircleElement,
  ) {
    desk.session.events.on("file", () => {
      this.cell = -1;
      this.near = null;
      this.showRing();
    });
    desk.events.on("selection", () => this.clear());
    desk.drawing.afterDraw = () => this.showRing();
  }

  private get mesh(): Mesh {
    return this.desk.session.mesh;
  }

  clear(): void {
    if (this.cell < 0) return;
    this.desk.drawing.cells.mark(Uint32Array.of(this.cell), MARK_CURSOR, false);
    this.cell = -1;
    this.desk.drawing.redraw();
  }

  /** Go to the neighbor to the right (x = 1), left, above (y = 1) or below; at first to a start. */
  move(x: number, y: number): void {
    const isFirst = this.cell < 0 || this.desk.isHidden(this.cell);
    const next = isFirst ? this.start() : this.next(x, y);
    if (next >= 0) this.go(next, isFirst);
    else this.desk.say(isFirst ? "Nothing is seen." : `No ${this.mesh.oneCell} lies that way.`);
  }

  private go(cell: number, isFirst: boolean): void {
    const { desk } = this;
    this.clear();
    this.cell = cell;
    desk.hover(-1);
    desk.drawing.cells.mark(Uint32Array.of(cell), MARK_CURSOR, true);
    desk.drawing.redraw();
    if (isFirst || !this.isWellSeen(cell)) this.fly(cell);
    const region = desk.regionOf(cell);
    const where = region < 0 ? "in no region" : `region ${region}`;
    desk.say(`${this.name}: ${where}, ${desk.className(desk.session.classes.of[cell])}.`);
  }

  private get name(): string {
    return `${capital(this.mesh.oneCell)} ${this.cell}`;
  }

  /** Give the cell a class; 0 takes it away. */
  paint(id: number): void {
    const { desk } = this;
    desk.session.paint(Uint32Array.of(this.cell), id);
    desk.say(id ? `${this.name}: ${desk.className(id)}.` : `${this.name}: class removed.`);
  }

  /** In the region of the keyboard's cursor, else what is seen nearest to the picture's middle. */
  private start(): number {
    const { cursor, session, drawing } = this.desk;
    if (cursor >= 0) return this.middleCell(session.regions.cellsOf(cursor));
    const { clientWidth, clientHeight } = drawing.canvas;
    const seen = drawing.cellsSeen(0, 0, clientWidth, clientHeight);
    let best = -1;
    let least = Infinity;
    seen.cells.forEach((cell, i) => {
      if (cell === NOT_SEEN) return;
      const column = (i % seen.width) - seen.width / 2;
      const row = Math.floor(i / seen.width) - seen.height / 2;
      const off = column * column + row * row;
      if (off < least) [best, least] = [cell, off];
    });
    return best;
  }

  private middleCell(cells: Uint32Array): number {
    const [middle, at] = [new Vector3(), new Vector3()];
    const shown = [...cells].filter((cell) => this.mesh.middleOf(cell, at) && !this.desk.isHidden(cell));
    for (const cell of shown) {
      this.mesh.middleOf(cell, at);
      middle.addScaledVector(at, 1 / shown.length);
    }
    const off = (cell: number): number => {
      this.mesh.middleOf(cell, at);
      return at.distanceToSquared(middle);
    };
    return shown.reduce((best, cell) => (best < 0 || off(cell) < off(best) ? cell : best), -1);
  }

  private next(x: number, y: number): number {
    const { mesh, desk } = this;
    const [right, up] = desk.drawing.camera.directions();
    const way = right.multiplyScalar(x).addScaledVector(up, y);
    const [from, at] = [new Vector3(), new Vector3()];
    mesh.middleOf(this.cell, from);
    this.near ??= mesh.isCloud ? new NearPoints(mesh) : new Touching(mesh);
    let best = -1;
    let most = 0;
    for (const cell of this.near.around(this.cell)) {
      if (cell === this.cell || desk.isHidden(cell) || !mesh.middleOf(cell, at)) continue;
      const distance = at.sub(from).length();
      const cosine = distance > 0 ? at.dot(way) / distance : 0;
      const worth = mesh.isCloud ? cosine / distance : cosine;
      if (cosine >= LEAST_COSINE && worth > most) [best, most] = [cell, worth];
    }
    return best;
  }

  private isWellSeen(cell: number): boolean {
    const { drawing, picker } = this.desk;
    const place = picker.placeOf(cell);
    if (!place) return false;
    const { clientWidth, clientHeight } = drawing.canvas;
    const [x, y] = [place.x / clientWidth, place.y / clientHeight];
    if (Math.min(x, y, 1 - x, 1 - y) < MARGIN) return false;
    return this.isFacing(cell) && picker.cellAt(place) === cell;
  }

  private isFacing(cell: number): boolean {
    const normal = this.mesh.normalOf(cell, new Vector3()).normalize();
    return normal.lengthSq() === 0 || normal.dot(this.desk.drawing.camera.directions()[2]) > LEAST_FACING;
  }

  /** Nearer, from where one looks now if the cell is seen from there. */
  private fly(cell: number): void {
    const { mesh } = this;
    const [middle, corner] = [new Vector3(), new Vector3()];
    mesh.middleOf(cell, middle);
    const triangle = mesh.triangleOf(cell);
    const radius = triangle < 0
      ? mesh.pointSize
      : mesh.corner(mesh.triangles![3 * triangle], corner).distanceTo(middle);
    const { drawing, picker } = this.desk;
    const place = picker.placeOf(cell);
    const isShown = place !== null && this.isFacing(cell) && picker.cellAt(place) === cell;
    const normal = isShown ? new Vector3() : mesh.normalOf(cell, new Vector3());
    drawing.camera.fly(middle, normal, STAND_OFF * radius);
  }

  private showRing(): void {
    const place = this.cell < 0 ? null : this.desk.picker.placeOf(this.cell);
    this.ring.toggleAttribute("hidden", place === null);
    if (!place) return;
    this.ring.setAttribute("cx", String(place.x));
    this.ring.setAttribute("cy", String(place.y));
  }
}

interface Nearby {
  around(cell: number): Iterable<number>;
}

/** Cells with a common vertex. */
class Touching implements Nearby {
  private readonly corners: Groups; // at each vertex
  private readonly triangles: Groups | null; // of each cell; null where triangle i is cell i

  constructor(private readonly mesh: Mesh) {
    this.corners = new Groups(mesh.triangles!, mesh.positions.length / 3);
    this.triangles = mesh.triangleCells && new Groups(mesh.triangleCells, mesh.nCells);
  }

  around(cell: number): Set<number> {
    const found = new Set<number>();
    for (const triangle of this.triangles?.of(cell) ?? [cell]) {
      for (let k = 0; k < 3; k++) {
        const vertex = this.mesh.triangles![3 * triangle + k];
        for (const corner of this.corners.of(vertex)) found.add(this.mesh.cellOf(Math.floor(corner / 3)));
      }
    }
    return found;
  }
}

/** Points within a few times their spacing. */
class NearPoints implements Nearby {
  constructor(private readonly mesh: Mesh) {}

  *around(point: number): Generator<number> {
    const { positions, pointSize, nCells } = this.mesh;
    const reach = (8 * pointSize) ** 2;
    const [x, y, z] = positions.subarray(3 * point, 3 * point + 3);
    for (let i = 0; i < nCells; i++) {
      const dx = positions[3 * i] - x;
      const dy = positions[3 * i + 1] - y;
      const dz = positions[3 * i + 2] - z;
      if (dx * dx + dy * dy + dz * dz <= reach) yield i;
    }
  }
}
