// Which cells are near: neighbors of a cell, and cells within a distance of a place.

import type { Vector } from "../shared/vectors";
import { Groups } from "./groups";
import type { Mesh } from "./mesh";

const MAX_BOXES = 128; // of the grid, along each side
const NEAR = 8; // diameters of a point within which others are its neighbors

export class Surroundings {
  private readonly grid: Grid;
  private readonly corners: Groups | null; // of triangles, at each vertex
  private readonly triangles: Groups | null; // of each cell; null where triangle i is cell i

  constructor(private readonly mesh: Mesh) {
    const { triangles, sources, positions } = mesh.shape;
    this.grid = new Grid(positions.values);
    this.corners = triangles && new Groups(triangles, positions.values.length / 3);
    this.triangles = sources && new Groups(sources, mesh.nCells);
  }

  /** Cells that have a vertex in a sphere; points in a sphere. */
  within(middle: Vector, radius: number): Set<number> {
    const vertices = this.grid.within(middle, radius);
    return this.corners ? this.cellsAt(vertices, this.corners) : new Set(vertices);
  }

  /** Cells with a common vertex; points nearby. */
  around(cell: number): Set<number> {
    const { mesh, corners } = this;
    const { triangles, facts } = mesh.shape;
    if (!triangles || !corners) return this.within(mesh.corner(cell), NEAR * facts.point_size);
    const own = this.triangles?.of(cell) ?? [cell];
    return this.cellsAt([...own].flatMap((i) => [...triangles.subarray(3 * i, 3 * i + 3)]), corners);
  }

  private cellsAt(vertices: number[], corners: Groups): Set<number> {
    const found = new Set<number>();
    for (const vertex of vertices) {
      for (const corner of corners.of(vertex)) found.add(this.mesh.cellOf(Math.floor(corner / 3)));
    }
    return found;
  }
}

/** Points in equal boxes. */
class Grid {
  private readonly low: Vector = [Infinity, Infinity, Infinity];
  private readonly counts: Vector; // of boxes along each axis
  private readonly side: number;
  private readonly members: Groups;

  constructor(private readonly points: ArrayLike<number>) {
    const high: Vector = [-Infinity, -Infinity, -Infinity];
    for (let i = 0; i < points.length; i++) {
      if (points[i] < this.low[i % 3]) this.low[i % 3] = points[i];
      if (points[i] > high[i % 3]) high[i % 3] = points[i];
    }
    const extents = high.map((value, k) => value - this.low[k]);
    this.side = Math.max(...extents) / Math.min(MAX_BOXES, Math.sqrt(points.length / 3)) || 1;
    this.counts = extents.map((extent) => Math.floor(extent / this.side) + 1) as Vector;
    const boxes = new Uint32Array(points.length / 3);
    for (let i = 0; i < boxes.length; i++) {
      boxes[i] = this.boxOf([0, 1, 2].map((k) => this.place(points[3 * i + k], k)) as Vector);
    }
    this.members = new Groups(boxes, this.counts[0] * this.counts[1] * this.counts[2]);
  }

  private place(value: number, axis: number): number {
    const place = Math.floor((value - this.low[axis]) / this.side);
    return Math.max(0, Math.min(this.counts[axis] - 1, place));
  }

  private boxOf([x, y, z]: Vector): number {
    return (x * this.counts[1] + y) * this.counts[2] + z;
  }

  within(middle: Vector, radius: number): number[] {
    const first = middle.map((value, k) => this.place(value - radius, k));
    const last = middle.map((value, k) => this.place(value + radius, k));
    const found: number[] = [];
    for (let x = first[0]; x <= last[0]; x++) {
      for (let y = first[1]; y <= last[1]; y++) {
        for (let z = first[2]; z <= last[2]; z++) this.take(this.boxOf([x, y, z]), middle, radius, found);
      }
    }
    return found;
  }

  private take(box: number, [x, y, z]: Vector, radius: number, found: number[]): void {
    const { points } = this;
    for (const i of this.members.of(box)) {
      const [dx, dy, dz] = [points[3 * i] - x, points[3 * i + 1] - y, points[3 * i + 2] - z];
      if (dx * dx + dy * dy + dz * dz <= radius * radius) found.push(i);
    }
  }
}
