// Texture with the class, object and marks of each cell.

import { type Gpu, Table } from "../../shared/gl";
import { usualShade } from "../data/colors";
import { classOf, objectOf } from "../data/labeling";

export const MARK_RED = 1; // the cell is in the red stroke of split mode
export const MARK_BLUE = 2; // the cell is in the blue stroke of split mode
export const MARK_HIDDEN = 4; // the cell is hidden
export const MARK_CURSOR = 8; // the keyboard cursor is on the cell
export const MARK_DIFFERS = 16; // the cell is labeled differently in the two compared files

export const N_MARK_BITS = 5; // the upper 3 bits of their byte contain the shade of the object

/** A texture with four bytes per cell: class (two bytes), mark bits and shade, and object. */
export class CellTable {
  readonly table: Table;
  hasHidden = false;
  private nCells = 0;

  /** `recolor` is called when cells get other colors (null: all cells), and `changeView` when cells are hidden or shown. */
  constructor(gpu: Gpu, private readonly recolor: (cells: Iterable<number> | null) => void, private readonly changeView: () => void) {
    this.table = new Table(gpu);
  }

  /** Set the number of cells, and clear class, object and marks of all cells. */
  reset(nCells: number): void {
    this.nCells = nCells;
    this.hasHidden = false;
    this.table.fill("rgba8ui", new Uint8Array(4 * nCells));
  }

  /**
   * Copy class and object of the given cells to the table, or of all cells if `cells` is null. Objects
   * are omitted for the classes in `stuff`, which have no separate objects. `shades` is the result of `shadesOfObjects`.
   */
  setPaint(paint: Uint32Array, cells: Uint32Array | null, stuff: ReadonlySet<number>, shades: ReadonlyMap<number, number>): void {
    const { texels } = this.table;
    const set = (cell: number): void => {
      texels[4 * cell] = paint[cell] & 255;
      texels[4 * cell + 1] = (paint[cell] >> 8) & 255;
      const object = stuff.has(classOf(paint[cell])) ? 0 : objectOf(paint[cell]);
      texels[4 * cell + 3] = object && 1 + ((object - 1) % 255); // values repeat after 255 objects, which suffices to distinguish neighbors
      const shade = object && (shades.get(paint[cell]) ?? usualShade(object));
      texels[4 * cell + 2] = (texels[4 * cell + 2] & ((1 << N_MARK_BITS) - 1)) | (shade << N_MARK_BITS);
      this.table.touch(cell);
    };
    if (cells) cells.forEach(set);
    else for (let cell = 0; cell < this.nCells; cell++) set(cell);
    this.recolor(cells);
  }

  marksOf(cell: number): number {
    return this.table.texels[4 * cell + 2];
  }

  isHidden(cell: number): boolean {
    return (this.marksOf(cell) & MARK_HIDDEN) !== 0;
  }

  get isAllHidden(): boolean {
    for (let cell = 0; cell < this.nCells; cell++) if (!this.isHidden(cell)) return false;
    return true;
  }

  /** Set or clear mark bits of the given cells. */
  mark(cells: readonly number[] | Uint32Array, bits: number, on: boolean): void {
    if (bits & MARK_HIDDEN && on) this.hasHidden = true;
    for (const cell of cells) {
      const old = this.marksOf(cell);
      this.table.texels[4 * cell + 2] = on ? old | bits : old & ~bits;
      this.table.touch(cell);
    }
    if (bits & MARK_HIDDEN) this.changeView();
    else this.recolor(cells);
  }

  /** Clear mark bits of all cells. */
  unmarkAll(bits: number): void {
    if (bits & MARK_HIDDEN) this.hasHidden = false;
    this.mark(new Uint32Array(this.nCells).map((_, cell) => cell).filter((cell) => this.marksOf(cell) & bits), bits, false);
  }
}
