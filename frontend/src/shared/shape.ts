// Geometry that is drawn: triangles or points.

import type { Arrays } from "./arrays";
import type { View } from "./camera";
import type { TextureFacts } from "./texture";
import type { Vector } from "./vectors";

export const NONE = 0xffffffff; // marks a missing cell, region or value

/** Coordinates of points, three values per point: coordinate = low + step * value. */
export interface Positions {
  values: Uint16Array | Float32Array;
  low: Vector;
  step: Vector;
}

/** JSON description of the geometry, written by superfacets_show.page.shape. */
export interface ShapeFacts {
  low: Vector;
  step: Vector;
  axes: [right: Vector, up: Vector, front: Vector];
  view: View;
  point_size: number;
  texture?: TextureFacts | null;
}

export interface Shape {
  facts: ShapeFacts;
  positions: Positions;
  triangles: Uint32Array | null; // three vertex indices per triangle; null for a point cloud, whose points are the cells
  sources: Uint32Array | null; // cell of each triangle, in ascending order; null if triangle i is cell i
  normals: Uint16Array | null; // encoded normal of each point of a cloud; null for a mesh
}

/** A box with sides parallel to the coordinate axes. */
export interface Box {
  low: Vector;
  high: Vector;
}

/** Position of a vertex or point. */
export const pointOf = ({ values, low, step }: Positions, i: number): Vector =>
  [0, 1, 2].map((k) => low[k] + step[k] * values[3 * i + k]) as Vector;

/** A box that contains nothing. */
export const emptyBox = (): Box => ({ low: [Infinity, Infinity, Infinity], high: [-Infinity, -Infinity, -Infinity] });

/** Bounding box of all positions. */
export function boundsOf({ values, low, step }: Positions): Box {
  const box = emptyBox();
  for (let i = 0; i < values.length; i++) {
    const value = low[i % 3] + step[i % 3] * values[i];
    box.low[i % 3] = Math.min(box.low[i % 3], value);
    box.high[i % 3] = Math.max(box.high[i % 3], value);
  }
  return box;
}

export function shapeOf(facts: ShapeFacts, arrays: Arrays): Shape {
  return {
    facts,
    positions: { values: arrays.positions as Uint16Array | Float32Array, low: facts.low, step: facts.step },
    triangles: (arrays.triangles as Uint32Array | undefined) ?? null,
    sources: (arrays.sources as Uint32Array | undefined) ?? null,
    normals: (arrays.normals as Uint16Array | undefined) ?? null,
  };
}
