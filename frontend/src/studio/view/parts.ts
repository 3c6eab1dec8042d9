// Parts of faces that are drawn like a face of another region, so that borders of regions are smooth curves.

import type { Arrays } from "../../shared/arrays";
import type { Eye } from "../../shared/camera";
import { type Gpu, type Program, Table, type Values } from "../../shared/gl";
import { type Shape, shapeOf } from "../../shared/shape";
import { Surface } from "../../shared/surface";
import { Groups } from "../data/labeling";
import type { Mesh } from "../data/mesh";

export class Parts {
  private readonly surface: Surface;
  private readonly shown: Table; // cell as which each part is drawn
  private shape: Shape | null = null; // one triangle per part, whose source is its cell; null if there are no parts
  private groups = new Groups(new Uint32Array(0), 0); // parts that are drawn as each cell

  constructor(gpu: Gpu) {
    this.surface = new Surface(gpu);
    this.shown = new Table(gpu);
  }

  get isEmpty(): boolean {
    return this.shape === null;
  }

  /** Take the parts of a mesh, as the server sends them; none if there are no arrays. */
  take({ shape: { facts }, nCells }: Mesh, arrays: Arrays): void {
    const shown = (arrays.shown ?? new Uint32Array(0)) as Uint32Array;
    this.shape = shown.length ? shapeOf(facts, arrays) : null;
    this.groups = new Groups(shown, nCells);
    this.shown.fill("r32", shown);
    this.upload();
  }

  /** Upload the geometry; called again after the WebGL context was lost. */
  upload(): void {
    if (this.shape) this.surface.show(this.shape);
  }

  draw(program: Program, eye: Eye, values: Values): void {
    this.surface.draw(program, eye, 0, { ...values, has_own_colors: false, are_of_vertices: false, shown: this.shown });
  }

  /** Cells that have a part drawn as one of the given cells. */
  partly(cells: Iterable<number>): number[] {
    const found: number[] = [];
    if (this.shape) for (const cell of cells) for (const part of this.groups.of(cell)) found.push(this.shape.sources![part]);
    return found;
  }
}
