// Region and class of each cell.

import { Groups } from "./groups";

export const NO_REGION = -1;

/** Cells of each region, one after the other. */
export class Regions {
  readonly count: number;
  readonly areas: Float64Array;
  private readonly groups: Groups;

  constructor(
    readonly labels: Int32Array,
    areas: Float32Array,
    readonly revision: number,
  ) {
    let highest = NO_REGION;
    for (const label of labels) if (label > highest) highest = label;
    this.count = highest + 1;
    this.areas = new Float64Array(this.count);
    for (let i = 0; i < labels.length; i++) if (labels[i] >= 0) this.areas[labels[i]] += areas[i];
    this.groups = new Groups(labels, this.count);
  }

  cellsOf(region: number): Uint32Array {
    return this.groups.of(region);
  }

  /** Cells of several regions in rising order. */
  cellsOfAll(regions: Iterable<number>): Uint32Array {
    const parts = [...regions].map((region) => this.cellsOf(region));
    const joined = new Uint32Array(parts.reduce((sum, part) => sum + part.length, 0));
    let at = 0;
    for (const part of parts) {
      joined.set(part, at);
      at += part.length;
    }
    return joined.sort();
  }
}

/** The class of each cell, with the area of each class kept up to date. */
export class Classes {
  readonly areaOf = new Map<number, number>();

  constructor(
    readonly of: Uint16Array,
    private readonly areas: Float32Array,
  ) {
    for (let i = 0; i < of.length; i++) this.shift(of[i], areas[i]);
  }

  private shift(id: number, area: number): void {
    this.areaOf.set(id, (this.areaOf.get(id) ?? 0) + area);
  }

  set(cell: number, id: number): void {
    this.shift(this.of[cell], -this.areas[cell]);
    this.shift(id, this.areas[cell]);
    this.of[cell] = id;
  }

  get totalArea(): number {
    let sum = 0;
    for (const area of this.areaOf.values()) sum += area;
    return sum;
  }

  /** Share of the area that has a class, 0 to 1. */
  get progress(): number {
    const total = this.totalArea;
    return total > 0 ? Math.min(1, Math.max(0, 1 - (this.areaOf.get(0) ?? 0) / total)) : 0;
  }

  /** Area without a class among some cells. */
  bareArea(cells: Uint32Array): number {
    let sum = 0;
    for (const cell of cells) if (this.of[cell] === 0) sum += this.areas[cell];
    return sum;
  }

  /** The class with the largest area among some cells. */
  mainClass(cells: Uint32Array): number {
    const sums = new Map<number, number>();
    for (const cell of cells) {
      sums.set(this.of[cell], (sums.get(this.of[cell]) ?? 0) + this.areas[cell]);
    }
    let best = 0;
    let most = -1;
    for (const [id, area] of sums) if (area > most) [best, most] = [id, area];
    return best;
  }
}
