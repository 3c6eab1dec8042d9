// Where the regions of the page are, and the sections that cut the mesh.

import type { Numbers } from "../shared/arrays";
import { type Box, boundsOf, NONE, pointOf, type Positions, type Shape } from "../shared/shape";
import { type Sphere, sphereOf, type Vector } from "../shared/vectors";

/** One point of each cell, by which regions are found after the triangles are deleted. */
export class Places {
  private readonly positions: Positions;
  private readonly bounds: Box;
  private readonly vertices: Uint32Array | null; // a vertex of each cell, or NONE for a cell inside a tetrahedral mesh; null for a cloud

  constructor({ positions, triangles, sources }: Shape, nCells: number) {
    this.positions = positions;
    this.bounds = boundsOf(positions);
    this.vertices = triangles && new Uint32Array(nCells).fill(NONE);
    for (let i = 0; triangles && i < triangles.length / 3; i++) this.vertices![sources ? sources[i] : i] = triangles[3 * i];
  }

  /** Middle and radius of the cells of a region; null if none of them is visible. */
  sphereOf(region: number, labels: Numbers): Sphere | null {
    const points: Vector[] = [];
    labels.forEach((label, cell) => {
      const vertex = this.vertices ? this.vertices[cell] : cell;
      if (label === region && vertex !== NONE) points.push(pointOf(this.positions, vertex));
    });
    return sphereOf(points);
  }

  /**
   * The part of the mesh on one side of a section. `name` is "" for the whole mesh, or the name of an axis after "-" for
   * low or "+" for high coordinates. `share` is the shown fraction of the length of the mesh along the axis.
   */
  section(name: string, share: number): Box | null {
    if (!name) return null;
    const [low, high]: Vector[] = [[...this.bounds.low], [...this.bounds.high]];
    const axis = "xyz".indexOf(name[1]);
    const extent = high[axis] - low[axis];
    if (name[0] === "-") high[axis] = low[axis] + share * extent;
    else low[axis] = high[axis] - share * extent;
    return { low, high };
  }
}
