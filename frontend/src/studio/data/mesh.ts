// The mesh sent by the server, and the geometry of its cells.

import { type Box, boundsOf, type Shape, type ShapeFacts, shapeOf } from "../../shared/shape";
import { cross, minus, plus, scaled, type Vector } from "../../shared/vectors";
import type { Arrays } from "../../shared/arrays";
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
  // First triangle of each cell; -1 if the cell is inside a tetrahedral mesh and has no triangle.
  private readonly firstTriangle: Int32Array | null;

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
    this.firstTriangle = this.shape.sources && firstPlaces(this.shape.sources, this.nCells);
  }

  /** A number of cells and their noun, for example "2 faces". */
  counted(n: number): string {
    return text.countedCells(n, [this.oneCell, this.cellName]);
  }

  get isCloud(): boolean {
    return this.shape.triangles === null;
  }

  /** The cell that a triangle belongs to. */
  cellOf(triangle: number): number {
    return this.shape.sources ? this.shape.sources[triangle] : triangle;
  }

  /** Bounding box of all vertices. */
  get bounds(): Box {
    return boundsOf(this.shape.positions);
  }

  corner(vertex: number): Vector {
    const { values } = this.shape.positions;
    return [values[3 * vertex], values[3 * vertex + 1], values[3 * vertex + 2]];
  }

  /** Corners of the first triangle of a cell; null for a point, and for a cell inside a tetrahedral mesh. */
  cornersOf(cell: number): [Vector, Vector, Vector] | null {
    const { triangles } = this.shape;
    const triangle = this.firstTriangle ? this.firstTriangle[cell] : cell;
    if (!triangles || triangle < 0) return null;
    const [a, b, c] = triangles.subarray(3 * triangle, 3 * triangle + 3);
    return [this.corner(a), this.corner(b), this.corner(c)];
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

function firstPlaces(values: Uint32Array, count: number): Int32Array {
  const places = new Int32Array(count).fill(-1);
  for (let i = values.length - 1; i >= 0; i--) places[values[i]] = i;
  return places;
}
