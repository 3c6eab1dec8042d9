// Region, class and object of each cell, and adjacency of regions.

import { readPacket } from "./packet";

/** Indices grouped by value with a counting sort. */
export class Groups {
  private readonly starts: Uint32Array;
  private readonly members: Uint32Array;

  /**
   * `values[i]` is the group of index `i`, from 0 to `count - 1`. An index with a negative value is in no group.
   */
  constructor(values: Int32Array | Uint32Array, count: number) {
    this.starts = new Uint32Array(count + 1);
    for (const value of values) if (value >= 0) this.starts[value + 1]++;
    for (let k = 0; k < count; k++) this.starts[k + 1] += this.starts[k];
    this.members = new Uint32Array(this.starts[count]);
    const next = this.starts.slice();
    for (let i = 0; i < values.length; i++) if (values[i] >= 0) this.members[next[values[i]]++] = i;
  }

  /** Indices in a group, in ascending order. */
  of(group: number): Uint32Array {
    return this.members.subarray(this.starts[group], this.starts[group + 1]);
  }
}

export function addTo(sums: Map<number, number>, key: number, value: number): void {
  sums.set(key, (sums.get(key) ?? 0) + value);
}

/** Concatenates several arrays. */
export function joined(parts: Uint32Array[]): Uint32Array {
  const all = new Uint32Array(parts.reduce((sum, part) => sum + part.length, 0));
  let at = 0;
  for (const part of parts) {
    all.set(part, at);
    at += part.length;
  }
  return all;
}

/** Adjacency of regions, rings around sets of regions, and a traversal of all regions. */
export class Neighbors {
  private readonly lists: number[][];

  constructor(buffer: ArrayBuffer, count: number) {
    const arcs = readPacket<object>(buffer).arrays.arcs as Uint32Array;
    this.lists = Array.from({ length: count }, () => []);
    for (let i = 0; i < arcs.length; i += 2) {
      this.lists[arcs[i]].push(arcs[i + 1]);
      this.lists[arcs[i + 1]].push(arcs[i]);
    }
  }

  of(region: number): readonly number[] {
    return this.lists[region] ?? [];
  }

  /** Regions outside a set that are adjacent to a region of the set. */
  ringAround(regions: ReadonlySet<number>): number[] {
    const ring = new Set<number>();
    for (const region of regions) {
      for (const other of this.of(region)) if (!regions.has(other)) ring.add(other);
    }
    return [...ring];
  }

  /** Regions of a set that have a neighbor outside the set. */
  outerRing(regions: ReadonlySet<number>): number[] {
    return [...regions].filter((region) => this.of(region).some((other) => !regions.has(other)));
  }

  /** All regions in depth-first order, so that most regions are adjacent to the next one. */
  walk(): number[] {
    return this.pieces(new Set(this.lists.keys())).flat();
  }

  /** The connected pieces of a set of regions, each in depth-first order. */
  pieces(regions: ReadonlySet<number>): number[][] {
    const found = new Set<number>();
    const pieces: number[][] = [];
    for (const first of regions) {
      if (found.has(first)) continue;
      const [piece, waiting] = [[] as number[], [first]];
      for (let region = waiting.pop(); region !== undefined; region = waiting.pop()) {
        if (found.has(region)) continue;
        found.add(region);
        piece.push(region);
        waiting.push(...this.of(region).filter((other) => regions.has(other) && !found.has(other)).reverse());
      }
      pieces.push(piece);
    }
    return pieces;
  }
}

/** The region of each cell, the cells of each region, and the adjacency of regions. */
export class Regions {
  readonly count: number;
  readonly areas: Float64Array;
  readonly neighbors: Neighbors;
  private readonly groups: Groups;

  /** `areas` contains the area of each cell. `graph` is a packet from the server with pairs of adjacent regions. */
  constructor(
    readonly labels: Int32Array, areas: Float32Array, graph: ArrayBuffer, readonly revision: number,
  ) {
    let highest = -1;
    for (const label of labels) if (label > highest) highest = label;
    this.count = highest + 1;
    this.areas = new Float64Array(this.count);
    for (let i = 0; i < labels.length; i++) if (labels[i] >= 0) this.areas[labels[i]] += areas[i];
    this.groups = new Groups(labels, this.count);
    this.neighbors = new Neighbors(graph, this.count);
  }

  cellsOf(region: number): Uint32Array {
    return this.groups.of(region);
  }

  /** Cells of several regions, in ascending order. */
  cellsOfAll(regions: Iterable<number>): Uint32Array {
    return joined([...regions].map((region) => this.cellsOf(region))).sort();
  }
}

/**
 * Encodes a class and an object of this class as one number, the paint: the object in the upper 16 bits
 * and the class in the lower 16 bits. The server uses the same encoding.
 */
export const paintOf = (id: number, object: number): number => (id && ((object << 16) | id)) >>> 0;

export const classOf = (paint: number): number => paint & 0xffff;

/** Object number of a paint; 0 means that the cell is in no object. */
export const objectOf = (paint: number): number => paint >>> 16;

/** Class and object of each cell (the paint), and the total area and number of cells of each paint. */
export class Paints {
  readonly areaOf = new Map<number, number>();
  readonly countOf = new Map<number, number>();

  constructor(readonly of: Uint32Array, private readonly areas: Float32Array) {
    for (let i = 0; i < of.length; i++) this.count(of[i], areas[i], 1);
  }

  private count(paint: number, area: number, n: number): void {
    addTo(this.areaOf, paint, area);
    addTo(this.countOf, paint, n);
  }

  set(cell: number, paint: number): void {
    this.count(this.of[cell], -this.areas[cell], -1);
    this.count(paint, this.areas[cell], 1);
    this.of[cell] = paint;
  }

  get totalArea(): number {
    return [...this.areaOf.values()].reduce((sum, area) => sum + area, 0);
  }

  /** Fraction of the area that has a class, 0 to 1. */
  get progress(): number {
    const total = this.totalArea;
    return total > 0 ? Math.min(1, Math.max(0, 1 - (this.areaOf.get(0) ?? 0) / total)) : 0;
  }

  /** Area of each class. */
  get areaOfClass(): Map<number, number> {
    const sums = new Map<number, number>();
    for (const [paint, area] of this.areaOf) addTo(sums, classOf(paint), area);
    return sums;
  }

  /** Objects of a class that have cells, in ascending order; 0 is included if cells have no object. */
  objectsOf(id: number): number[] {
    const found: number[] = [];
    for (const [paint, n] of this.countOf) if (n > 0 && classOf(paint) === id) found.push(objectOf(paint));
    return found.sort((a, b) => a - b);
  }

  /** Cells of a class or, if `object` is given, of one object of the class. */
  cellsOf(id: number, object?: number): Uint32Array {
    const { of } = this;
    const found: number[] = [];
    for (let cell = 0; cell < of.length; cell++) {
      if (classOf(of[cell]) === id && (object === undefined || objectOf(of[cell]) === object)) found.push(cell);
    }
    return Uint32Array.from(found);
  }

  /** Total area of the given cells that have no class. */
  bareArea(cells: Uint32Array): number {
    return cells.reduce((sum, cell) => sum + (this.of[cell] ? 0 : this.areas[cell]), 0);
  }

  /** The paint (class and object) with the largest area among the given cells, except the paints in `ignored`. */
  mainPaint(cells: Uint32Array, ignored: readonly number[] = []): number {
    const sums = new Map<number, number>();
    for (const cell of cells) addTo(sums, this.of[cell], this.areas[cell]);
    let best = 0;
    let most = -1;
    for (const [paint, area] of sums) if (area > most && !ignored.includes(paint)) [best, most] = [paint, area];
    return best;
  }
}
