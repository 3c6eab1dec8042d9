// The mesh sent by the server, and the geometry of its cells.

import { type Box, type Shape, type ShapeFacts, shapeOf } from "../../shared/shape";
import { cross, minus, plus, scaled, type Vector } from "../../shared/vectors";
import type { Arrays } from "../../shared/arrays";
import { Groups } from "./labeling";
import { readPacket } from "./packet";
import type { Rgb } from "./colors";
import { text } from "../text/index";

type Kind = "triangles" | "polygons" | "points" | "tets";

interface Header extends ShapeFacts {
  kind: Kind;
  n_cells: number;
  measure: "area" | "volume";
  has_normals: boolean;
  palette: Rgb[]; // colors from which the colors of regions are chosen
  texture_problem: string; // reason why the texture is not shown; empty if there is no problem
}

export class Mesh {
  readonly shape: Shape;
  readonly arrays: Arrays;
  readonly textureProblem: string;
  readonly nCells: number;
  readonly areas: Float32Array; // area of each cell, or volume if cells are tetrahedra
  readonly measure: "area" | "volume";
  readonly hasNormals: boolean; // whether the front of each cell is known; false for a point cloud with estimated normals
  readonly palette: Rgb[];
  readonly oneCell: string; // singular noun for a cell
  readonly cellName: string; // plural noun for cells
  private readonly triangles: Groups | null; // triangles of each cell; null if triangle i is cell i

  constructor(buffer: ArrayBuffer) {
    const { header, arrays } = readPacket<Header>(buffer);
    this.shape = shapeOf(header, arrays);
    this.arrays = arrays;
    this.textureProblem = header.texture_problem;
    this.nCells = header.n_cells;
    this.measure = header.measure;
    this.hasNormals = header.has_normals;
    this.palette = header.palette;
    this.areas = arrays.areas as Float32Array;
    [this.oneCell, this.cellName] = text.cellNames[header.kind];
    this.triangles = this.shape.sources && new Groups(this.shape.sources, this.nCells);
  }

  /** A number of cells and their noun, for example "2 faces". */
  counted(n: number): string {
    return text.countedCells(n, [this.oneCell, this.cellName]);
  }

  get isCloud(): boolean {
    return this.shape.triangles === null;
  }

  corner(vertex: number): Vector {
    const { values } = this.shape.positions;
    return [values[3 * vertex], values[3 * vertex + 1], values[3 * vertex + 2]];
  }

  /** Vertices of the triangles of a cell, three for each; a point itself; none for a cell inside a tetrahedral mesh. */
  verticesOf(cell: number): Uint32Array {
    const { triangles } = this.shape;
    if (!triangles) return Uint32Array.of(cell);
    const { length, 0: first = 0 } = this.triangles?.of(cell) ?? [cell]; // without gaps, because sources are ascending
    return triangles.subarray(3 * first, 3 * (first + length));
  }

  /** Extend a box so that it contains the triangles, or drawn points, of some cells. */
  extend({ low, high }: Box, cells: Iterable<number>): void {
    const { positions: { values }, facts: { point_size } } = this.shape; // the size is 0 for a mesh
    for (const cell of cells) {
      for (const vertex of this.verticesOf(cell)) {
        for (let k = 0; k < 3; k++) {
          low[k] = Math.min(low[k], values[3 * vertex + k] - point_size / 2);
          high[k] = Math.max(high[k], values[3 * vertex + k] + point_size / 2);
        }
      }
    }
  }

  /** Corners of the first triangle of a cell; null for a point, and for a cell inside a tetrahedral mesh. */
  cornersOf(cell: number): [Vector, Vector, Vector] | null {
    const [a, b, c] = this.verticesOf(cell);
    return c === undefined ? null : [this.corner(a), this.corner(b), this.corner(c)];
  }

  /** Centroid of the first triangle of a cell, or the point itself; null for a cell inside a tetrahedral mesh. */
  middleOf(cell: number): Vector | null {
    if (this.isCloud) return this.corner(cell);
    const corners = this.cornersOf(cell);
    return corners && scaled(plus(plus(corners[0], corners[1]), corners[2]), 1 / 3);
  }

  /**
   * Normal of the first triangle of a cell, with twice the triangle's area as length. The normal is zero for a point,
   * and for a cell inside a tetrahedral mesh.
   */
  normalOf(cell: number): Vector {
    const corners = this.cornersOf(cell);
    if (!corners) return [0, 0, 0];
    const [a, b, c] = corners;
    return cross(minus(b, a), minus(c, a));
  }
}
