// The mesh as the server sends it, and the geometry of its cells.

import { Vector3 } from "three";
import { readContainer } from "./container";

export type Kind = "triangles" | "polygons" | "points" | "tets";

interface Header {
  kind: Kind;
  n_cells: number;
  measure: "area" | "volume";
  up: "y" | "z";
  point_size: number; // diameter; of points only
}

// Rows: right, up, toward the viewer.
const AXES = {
  y: [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
  z: [[1, 0, 0], [0, 0, 1], [0, -1, 0]],
};

// One, and several.
const CELL_NAMES: Record<Kind, [string, string]> = {
  triangles: ["triangle", "triangles"],
  polygons: ["face", "faces"],
  points: ["point", "points"],
  tets: ["tetrahedron", "tetrahedra"],
};

export class Mesh {
  readonly kind: Kind;
  readonly nCells: number;
  readonly axes: number[][];
  readonly positions: Float32Array; // (V, 3)
  readonly triangles: Uint32Array | null; // (T, 3); null for points
  readonly triangleCells: Uint32Array | null; // (T,); null where triangle i is cell i
  readonly areas: Float32Array; // (n_cells,); volumes of tetrahedra
  readonly measure: "area" | "volume";
  readonly normals: Float32Array | null; // (V, 3), of points only
  readonly pointSize: number;
  readonly oneCell: string; // what a cell is called
  readonly cellName: string; // and several
  private readonly firstTriangle: Int32Array | null; // of each cell; -1 where none is outside

  constructor(buffer: ArrayBuffer) {
    const { header, arrays } = readContainer<Header>(buffer);
    this.kind = header.kind;
    this.nCells = header.n_cells;
    this.axes = AXES[header.up];
    this.measure = header.measure;
    this.pointSize = header.point_size;
    this.normals = (arrays.normals as Float32Array | undefined) ?? null;
    this.positions = arrays.positions as Float32Array;
    this.areas = arrays.areas as Float32Array;
    const isCloud = header.kind === "points";
    this.triangles = isCloud ? null : (arrays.triangles as Uint32Array);
    this.triangleCells = (arrays.triangle_cells as Uint32Array | undefined) ?? null;
    [this.oneCell, this.cellName] = CELL_NAMES[header.kind];
    this.firstTriangle = this.triangleCells && firstPlaces(this.triangleCells, this.nCells);
  }

  get isCloud(): boolean {
    return this.triangles === null;
  }

  /** The cell that a triangle shows. */
  cellOf(triangle: number): number {
    return this.triangleCells ? this.triangleCells[triangle] : triangle;
  }

  /** A triangle of a cell, or -1 for a cell inside a body and for a point. */
  triangleOf(cell: number): number {
    if (this.isCloud) return -1;
    return this.firstTriangle ? this.firstTriangle[cell] : cell;
  }

  corner(vertex: number, into: Vector3): Vector3 {
    return into.fromArray(this.positions, 3 * vertex);
  }

  /** The middle of a cell as seen from outside; false where it cannot be seen. */
  middleOf(cell: number, into: Vector3): boolean {
    if (this.isCloud) {
      this.corner(cell, into);
      return true;
    }
    const triangle = this.triangleOf(cell);
    if (triangle < 0) return false;
    into.set(0, 0, 0);
    for (let k = 0; k < 3; k++) into.add(this.corner(this.triangles![3 * triangle + k], scratch[0]));
    into.divideScalar(3);
    return true;
  }

  /** The normal of a cell, as long as twice its triangle's area; zero where there is none. */
  normalOf(cell: number, into: Vector3): Vector3 {
    const triangle = this.triangleOf(cell);
    if (triangle < 0) return into.set(0, 0, 0);
    const [a, b, c] = scratch;
    this.corner(this.triangles![3 * triangle], a);
    this.corner(this.triangles![3 * triangle + 1], b).sub(a);
    this.corner(this.triangles![3 * triangle + 2], c).sub(a);
    return into.crossVectors(b, c);
  }
}

const scratch = [new Vector3(), new Vector3(), new Vector3()];

function firstPlaces(values: Uint32Array, count: number): Int32Array {
  const places = new Int32Array(count).fill(-1);
  for (let i = values.length - 1; i >= 0; i--) places[values[i]] = i;
  return places;
}
