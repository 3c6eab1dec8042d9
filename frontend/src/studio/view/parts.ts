// Parts of faces that are drawn like a face of another region, so that borders of regions are smooth curves.

import type { Arrays } from "../../shared/arrays";
import type { Eye } from "../../shared/camera";
import { type Gpu, type Program, Table, type Values } from "../../shared/gl";
import type { Shape } from "../../shared/shape";
import { Surface } from "../../shared/surface";

export class Parts {
  private readonly surface: Surface;
  private readonly table: Table; // cell as which each part is drawn
  private shape: Shape | null = null; // one triangle per part; null if there are none
  private readonly others = new Map<number, number[]>(); // cells with parts that are drawn as this cell

  constructor(gpu: Gpu) {
    this.surface = new Surface(gpu);
    this.table = new Table(gpu);
  }

  /** Show the parts in a response of the server to "borders", on a mesh; none, if there are no arrays. */
  show({ facts, positions: { low, step } }: Shape, { positions, sources, shown }: Arrays): void {
    this.others.clear();
    this.shape = null;
    if (!positions?.length || !sources || !shown) return;
    const triangles = Uint32Array.from({ length: positions.length / 3 }, (_, i) => i);
    this.shape = { facts, positions: { values: positions as Float32Array, low, step }, triangles, sources: Uint32Array.from(sources), normals: null };
    this.table.fill("r32", shown);
    sources.forEach((cell, i) => {
      const cells = this.others.get(shown[i]);
      if (cells) cells.push(cell);
      else this.others.set(shown[i], [cell]);
    });
    this.restore();
  }

  /** Upload the geometry; called again after the WebGL context was lost. */
  restore(): void {
    if (this.shape) this.surface.show(this.shape);
  }

  draw(program: Program, eye: Eye, values: Values): void {
    if (this.shape) this.surface.draw(program, eye, 0, { ...values, has_own_colors: false, are_of_vertices: false, are_parts: true, shown: this.table });
  }

  /** Cells with parts that are drawn as one of the given cells. */
  partly(cells: Iterable<number>): number[] {
    const found: number[] = [];
    if (this.shape) for (const cell of cells) found.push(...this.others.get(cell) ?? []);
    return found;
  }
}
