// Cells at and around a place of the picture, places of cells, and neighbors of cells.

import type { Place } from "../shared/picking";
import { NONE } from "../shared/shape";
import { dot, type Vector } from "../shared/vectors";
import type { Drawing } from "./drawing";
import { Groups } from "./labeling";
import type { Mesh } from "./mesh";

const SLABS = 1024; // number of slabs across the longest side of the mesh
const NEAR = 8; // radius of a point's neighborhood, in diameters of a drawn point

export class Picker {
  private known: Surroundings | null = null;

  constructor(private readonly drawing: Drawing, private readonly mesh: Mesh) {}

  /** Built on first use: looking at a mesh does not need it. */
  get surroundings(): Surroundings {
    return (this.known ??= new Surroundings(this.mesh));
  }

  /** The visible cell at a place; -1 for none. */
  cellAt(place: Place): number {
    const [cell] = this.drawing.cellsSeen(place.x, place.y, 1, 1).cells;
    return cell === NONE ? -1 : cell;
  }

  /** Cells around a place, on the same side of the body, within a distance in pixels. */
  cellsAround(place: Place, pixels: number): number[] {
    const { mesh, drawing } = this;
    const cell = this.cellAt(place);
    const middle = cell < 0 ? null : mesh.middleOf(cell);
    if (!middle) return [];
    const { camera, canvas } = drawing;
    const radius = (pixels * camera.distanceTo(middle)) / camera.pixelsOf(canvas.clientHeight);
    const facing = mesh.normalOf(cell);
    const found = [...this.surroundings.within(middle, radius).add(cell)];
    const isSeen = (other: number): boolean => !drawing.cells.isHidden(other) && !drawing.isCut(mesh.middleOf(other) ?? middle);
    return found.filter((other) => isSeen(other) && dot(mesh.normalOf(other), facing) >= 0);
  }

  /** Position of a cell in the picture; null if it is outside. */
  placeOf(cell: number): Place | null {
    const middle = this.mesh.middleOf(cell);
    return middle && this.placeIn(middle);
  }

  /** Position in the picture of a place of the mesh; null if it is outside. */
  placeIn(place: Vector): Place | null {
    const { camera, canvas } = this.drawing;
    const shares = camera.placeOf(place);
    return shares && { x: shares[0] * canvas.clientWidth, y: shares[1] * canvas.clientHeight };
  }
}

/** Move a circle of the overlay to a place, or hide it. */
export function putCircle(circle: SVGCircleElement, place: Place | null): void {
  circle.toggleAttribute("hidden", place === null);
  circle.setAttribute("cx", String(place?.x ?? -99));
  circle.setAttribute("cy", String(place?.y ?? -99));
}

/** Neighbors of a cell, and cells within a distance of a place. */
class Surroundings {
  private readonly corners: Groups | null; // triangle corners at each vertex; null for a cloud
  private readonly triangles: Groups | null; // triangles of each cell; null if triangle i is cell i
  private readonly slabs: Groups; // vertices in each slab
  private axis = 0; // axis of the longest side, along which slabs are stacked
  private low = 0;
  private extent = 0;

  constructor(private readonly mesh: Mesh) {
    const { triangles, sources, positions } = mesh.shape;
    const { values } = positions;
    this.corners = triangles && new Groups(triangles, values.length / 3);
    this.triangles = sources && new Groups(sources, mesh.nCells);
    for (let axis = 0; axis < 3; axis++) this.measure(values, axis);
    const slabs = new Uint32Array(values.length / 3);
    for (let i = 0; i < slabs.length; i++) slabs[i] = this.slabOf(values[3 * i + this.axis]);
    this.slabs = new Groups(slabs, SLABS);
  }

  private measure(values: ArrayLike<number>, axis: number): void {
    let [low, high] = [Infinity, -Infinity];
    for (let i = axis; i < values.length; i += 3) {
      low = Math.min(low, values[i]);
      high = Math.max(high, values[i]);
    }
    if (high - low > this.extent) Object.assign(this, { axis, low, extent: high - low });
  }

  private slabOf(value: number): number {
    const share = this.extent ? (value - this.low) / this.extent : 0;
    return Math.max(0, Math.min(SLABS - 1, Math.floor(SLABS * share)));
  }

  /** Cells that have a vertex in this sphere; for a cloud, the points in it. */
  within(middle: Vector, radius: number): Set<number> {
    const { values } = this.mesh.shape.positions;
    const [x, y, z] = middle;
    const vertices: number[] = [];
    const last = this.slabOf(middle[this.axis] + radius);
    for (let slab = this.slabOf(middle[this.axis] - radius); slab <= last; slab++) {
      for (const i of this.slabs.of(slab)) {
        const [dx, dy, dz] = [values[3 * i] - x, values[3 * i + 1] - y, values[3 * i + 2] - z];
        if (dx * dx + dy * dy + dz * dz <= radius * radius) vertices.push(i);
      }
    }
    return this.corners ? this.cellsAt(vertices, this.corners) : new Set(vertices);
  }

  /** A cell, and the cells that share a vertex with it; for a cloud, the points nearby. */
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

/** Places on the line between two places, at most `step` pixels apart; the first is left out. */
export function placesBetween(from: Place, to: Place, step: number): Place[] {
  const count = Math.max(1, Math.ceil(Math.hypot(to.x - from.x, to.y - from.y) / step));
  return Array.from({ length: count }, (_, i) => ({
    x: from.x + ((to.x - from.x) * (i + 1)) / count,
    y: from.y + ((to.y - from.y) * (i + 1)) / count,
  }));
}
