// Finds the cells at a position of the canvas, the canvas position of a cell, and the neighbors of a cell.

import type { Place } from "../../shared/picking";
import { boundsOf, NONE } from "../../shared/shape";
import { dot, type Vector } from "../../shared/vectors";
import { COVER, type Drawing, type Seen } from "./drawing";
import { Groups } from "../data/labeling";
import type { Mesh } from "../data/mesh";

const SLABS = 1024; // number of slabs into which the longest side of the mesh is divided
// Smallest depth between a surface and a cell seen through its gaps, in multiples of the diameter of a drawn point. At
// smaller depths, such as in the corner of a room, points also cover cells of their own surface.
const MIN_BEHIND = 2;
const CIRCLE = Array.from({ length: 16 }, (_, i) => [Math.cos((i * Math.PI) / 8), Math.sin((i * Math.PI) / 8)]);
const NEAR = 8; // radius of the neighborhood of a point, in multiples of the diameter of a drawn point

export class Picker {
  private known: Surroundings | null = null;

  constructor(private readonly drawing: Drawing, private readonly mesh: Mesh) {}

  /** Search structure, built on first use because viewing a mesh does not need it. */
  get surroundings(): Surroundings {
    return (this.known ??= new Surroundings(this.mesh));
  }

  /** The visible cell at a canvas position; -1 if there is none. A cell seen only through a gap is not visible. */
  cellAt(place: Place): number {
    const [cell] = this.drawing.cellsSeen(place.x, place.y, 1, 1).cells;
    return this.frontOf()(cell, place.x, place.y) | 0; // NONE becomes -1
  }

  /** The visible cell at each pixel of the canvas, or NONE. Cells seen only through gaps are not visible. */
  cellsSeen(): Seen {
    const seen = this.drawing.cellsSeen();
    if (!this.mesh.isCloud) return seen; // surfaces have no gaps
    const { width, height, scale } = seen;
    const front = this.frontOf();
    const cells = seen.cells.map((cell, i) => {
      const [x, y] = [((i % width) + 0.5) / scale, (height - Math.floor(i / width) - 0.5) / scale];
      return front(cell, x, y) === cell ? cell : NONE;
    });
    return { ...seen, cells };
  }

  /**
   * Returns a function that maps a cell, or NONE, drawn at a canvas position to itself or, if the position is in a gap
   * between the points of a surface in front of it, to a point of this surface. A position is in a gap if enlarged points
   * in front of the cell cover it, and also cover a circle around it whose radius is that of the enlarged points. The
   * circle leaves the silhouette of an object, so positions beside an object are not in a gap.
   */
  private frontOf(): (cell: number, x: number, y: number) => number {
    const { drawing: { camera, canvas }, mesh: { isCloud, shape: { positions: { values }, facts } } } = this;
    if (!isCloud) return (cell) => cell;
    const { cells, width, height, scale } = this.drawing.coversSeen();
    const depths = camera.depths;
    const depthOf = (cell: number): number => (cell === NONE ? Infinity : depths(values.subarray(3 * cell, 3 * cell + 3)));
    const pixels = 0.5 * COVER * facts.point_size * camera.pixelsOf(canvas.clientHeight); // radius at distance 1
    return (cell, x, y) => {
      const limit = depthOf(cell) - MIN_BEHIND * facts.point_size;
      const coverAt = (u: number, v: number): number | undefined => {
        const [column, row] = [Math.floor(u * scale), height - 1 - Math.floor(v * scale)];
        return column >= 0 && column < width ? cells[row * width + column] : undefined; // undefined outside the canvas
      };
      const isInFront = (cover: number | undefined): boolean => cover === undefined || depthOf(cover) < limit;
      const cover = coverAt(x, y) ?? NONE;
      if (cover === cell || !isInFront(cover)) return cell;
      const radius = Math.max(1, pixels / depthOf(cover));
      return CIRCLE.every(([u, v]) => isInFront(coverAt(x + radius * u, y + radius * v))) ? cover : cell;
    };
  }

  /**
   * Cells within a distance in pixels of the cell at a canvas position. Hidden cells and clipped cells are excluded.
   * Unless `isBall` is set, cells seen through gaps, and cells whose normals differ by more than 90 degrees from the
   * normal of the cell at the position, are excluded, too.
   */
  cellsAround(place: Place, pixels: number, isBall = false): number[] {
    const { mesh, drawing } = this;
    const cell = this.cellAt(place);
    const middle = cell < 0 ? null : mesh.middleOf(cell);
    if (!middle) return [];
    const { camera, canvas } = drawing;
    const radius = (pixels * camera.distanceTo(middle)) / camera.pixelsOf(canvas.clientHeight);
    const facing = mesh.normalOf(cell);
    const found = [...this.surroundings.within(middle, radius).add(cell)];
    const front = this.frontOf();
    const isShown = (other: number): boolean => !drawing.cells.isHidden(other) && !drawing.isCut(mesh.middleOf(other) ?? middle);
    const isInFront = (other: number): boolean => {
      const at = this.placeOf(other);
      return !at || front(other, at.x, at.y) === other;
    };
    return found.filter((other) => isShown(other) && (isBall || (isInFront(other) && dot(mesh.normalOf(other), facing) >= 0)));
  }

  /** Canvas position of a cell; null if the cell is outside the view, or inside a tetrahedral mesh. */
  placeOf(cell: number): Place | null {
    const middle = this.mesh.middleOf(cell);
    return middle && this.placeIn(middle);
  }

  /** Canvas position of a point of the mesh; null if the point is outside the view. */
  placeIn(place: Vector): Place | null {
    const { camera, canvas } = this.drawing;
    const fractions = camera.placeOf(place);
    return fractions && { x: fractions[0] * canvas.clientWidth, y: fractions[1] * canvas.clientHeight };
  }
}

/** Move a circle of the SVG overlay to a canvas position; null hides the circle. */
export function putCircle(circle: SVGCircleElement, place: Place | null): void {
  circle.toggleAttribute("hidden", place === null);
  circle.setAttribute("cx", String(place?.x ?? -99));
  circle.setAttribute("cy", String(place?.y ?? -99));
}

/** Search structure for the neighbors of a cell and for the cells near a point. */
class Surroundings {
  private readonly corners: Groups | null; // triangle corners at each vertex; null for a point cloud
  private readonly slabs: Groups; // vertices in each slab
  private readonly axis: number; // axis of the longest side of the mesh, which is divided into slabs
  private readonly low: number; // lowest coordinate of the mesh on this axis
  private readonly extent: number; // length of the mesh along this axis

  constructor(private readonly mesh: Mesh) {
    const { triangles, positions: { values } } = mesh.shape;
    this.corners = triangles && new Groups(triangles, values.length / 3);
    const { low, high } = boundsOf(mesh.shape.positions);
    const extents = high.map((value, k) => value - low[k]);
    this.axis = extents.indexOf(Math.max(...extents));
    [this.low, this.extent] = [low[this.axis], extents[this.axis]];
    const slabs = new Uint32Array(values.length / 3);
    for (let i = 0; i < slabs.length; i++) slabs[i] = this.slabOf(values[3 * i + this.axis]);
    this.slabs = new Groups(slabs, SLABS);
  }

  private slabOf(value: number): number {
    const fraction = this.extent ? (value - this.low) / this.extent : 0;
    return Math.max(0, Math.min(SLABS - 1, Math.floor(SLABS * fraction)));
  }

  /** Cells that have a vertex inside a sphere; for a point cloud, the points inside the sphere. */
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

  /** A cell and all cells that share a vertex with it; for a point cloud, all points nearby. */
  around(cell: number): Set<number> {
    const { mesh, corners } = this;
    if (!corners) return this.within(mesh.corner(cell), NEAR * mesh.shape.facts.point_size);
    return this.cellsAt(mesh.verticesOf(cell), corners);
  }

  private cellsAt(vertices: Iterable<number>, corners: Groups): Set<number> {
    const { sources } = this.mesh.shape;
    const found = new Set<number>();
    for (const vertex of vertices) {
      for (const corner of corners.of(vertex)) found.add(sources ? sources[Math.floor(corner / 3)] : Math.floor(corner / 3));
    }
    return found;
  }
}

/** Positions on the segment from `from` to `to`, at most `step` pixels apart, without `from` itself. */
export function placesBetween(from: Place, to: Place, step: number): Place[] {
  const count = Math.max(1, Math.ceil(Math.hypot(to.x - from.x, to.y - from.y) / step));
  return Array.from({ length: count }, (_, i) => ({
    x: from.x + ((to.x - from.x) * (i + 1)) / count,
    y: from.y + ((to.y - from.y) * (i + 1)) / count,
  }));
}
