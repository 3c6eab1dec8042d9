// Parts of faces that are drawn like a face of another region, so that borders of regions are smooth curves.

import type { Arrays } from "../../shared/arrays";
import { Table } from "../../shared/gl";
import { shapeOf } from "../../shared/shape";
import { Surface } from "../../shared/surface";
import { Groups } from "../data/labeling";
import type { Mesh } from "../data/mesh";

export class Parts extends Surface {
  isEmpty = true;
  private cells = new Uint32Array(0); // cell of each part
  private groups = new Groups(this.cells, 0); // parts that are drawn as each cell
  readonly shown = new Table(this.gpu); // cell as which each part is drawn

  /** Take the parts of a mesh, as the server sends them; none if there are no arrays. */
  take({ shape: { facts }, nCells }: Mesh, arrays: Arrays): void {
    const [sources, shown] = [arrays.sources, arrays.shown].map((array) => (array ?? new Uint32Array(0)) as Uint32Array<ArrayBuffer>);
    this.cells = sources;
    this.isEmpty = !sources.length;
    this.groups = new Groups(shown, this.isEmpty ? 0 : nCells);
    this.shown.fill("r32", shown);
    if (!this.isEmpty) this.show(shapeOf(facts, arrays));
  }

  /** Cells that have a part drawn as one of the given cells. */
  partly(cells: Iterable<number>): number[] {
    const found: number[] = [];
    if (!this.isEmpty) for (const cell of cells) for (const part of this.groups.of(cell)) found.push(this.cells[part]);
    return found;
  }
}
