// Geometry to draw: triangles or points.

import type { Arrays } from "./arrays";
import type { View } from "./camera";
import type { TextureFacts } from "./texture";
import type { Vector } from "./vectors";

export const NONE = 0xffffffff; // no cell, no region, no value

/** Three numbers per point: coordinates in steps from the low corner of the box. */
export interface Positions {
  values: Uint16Array | Float32Array;
  low: Vector;
  step: Vector;
}

/** Description of a shape, written by superfacets.pictures.page.shape. */
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
  triangles: Uint32Array | null; // vertex indices, three each; null: the points are the cells
  sources: Uint32Array | null; // cell of each triangle; null: triangle i is cell i
  normals: Uint16Array | null; // packed normal of each point
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
