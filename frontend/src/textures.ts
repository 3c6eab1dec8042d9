// Numbers that shaders look up: of vertices, cells, regions and classes.

import {
  DataTexture, NearestFilter, RedIntegerFormat, RGBAFormat, RGBAIntegerFormat, UnsignedByteType,
  UnsignedIntType,
} from "three";
import type { Rgb } from "./colors";

export const WIDTH = 2048; // of textures: each WebGL 2 has room for it
const MAX_CLASSES = 65536;
// A change that touches more rows than these is sent as one whole.
const MAX_ROWS = 64;

const rowsOf = (count: number): number => Math.max(1, Math.ceil(count / WIDTH));

function finished(texture: DataTexture): DataTexture {
  texture.minFilter = NearestFilter;
  texture.magFilter = NearestFilter;
  texture.generateMipmaps = false;
  texture.unpackAlignment = 1;
  texture.needsUpdate = true;
  return texture;
}

/** Vertex positions as bits, and a packed normal. */
export function vertexTexture(positions: Float32Array): DataTexture {
  const count = positions.length / 3;
  const texels = new Uint32Array(4 * WIDTH * rowsOf(count));
  const bits = new Uint32Array(positions.buffer, positions.byteOffset, positions.length);
  for (let i = 0; i < count; i++) texels.set(bits.subarray(3 * i, 3 * i + 3), 4 * i);
  return finished(
    new DataTexture(texels, WIDTH, rowsOf(count), RGBAIntegerFormat, UnsignedIntType),
  );
}

export function setNormals(texture: DataTexture, packed: Uint32Array): void {
  const texels = texture.image.data as unknown as Uint32Array;
  for (let i = 0; i < packed.length; i++) texels[4 * i + 3] = packed[i];
  texture.needsUpdate = true;
}

/** One whole number for each of many things; -1 becomes the largest. */
export function numberTexture(values: Uint32Array | Int32Array): DataTexture {
  const texels = new Uint32Array(WIDTH * rowsOf(values.length));
  texels.set(values);
  return finished(
    new DataTexture(texels, WIDTH, rowsOf(values.length), RedIntegerFormat, UnsignedIntType),
  );
}

export const MARK_RED = 1; // strokes of split mode
export const MARK_BLUE = 2;
export const MARK_HIDDEN = 4;
export const MARK_CURSOR = 8; // the keyboard's, on one cell

/** Per cell: its class in two bytes, and marks. */
export class CellTexture {
  readonly texture: DataTexture;
  private readonly texels: Uint8Array;
  private isWhole = true; // all of it waits to be sent
  hasHidden = false;

  constructor(private readonly nCells: number) {
    this.texels = new Uint8Array(4 * WIDTH * rowsOf(nCells));
    this.texture = finished(
      new DataTexture(this.texels, WIDTH, rowsOf(nCells), RGBAIntegerFormat, UnsignedByteType),
    );
  }

  setClasses(ids: Uint16Array, cells: Uint32Array | null): void {
    if (!cells) {
      for (let cell = 0; cell < this.nCells; cell++) this.setClass(cell, ids[cell]);
      this.sendWhole();
      return;
    }
    for (const cell of cells) this.setClass(cell, ids[cell]);
    this.touched(cells);
  }

  private setClass(cell: number, id: number): void {
    this.texels[4 * cell] = id & 255;
    this.texels[4 * cell + 1] = id >> 8;
  }

  marksOf(cell: number): number {
    return this.texels[4 * cell + 2];
  }

  /** Set or clear bits of some cells. */
  mark(cells: Uint32Array, bits: number, on: boolean): void {
    if (bits & MARK_HIDDEN && on) this.hasHidden = true;
    for (const cell of cells) {
      const old = this.texels[4 * cell + 2];
      this.texels[4 * cell + 2] = on ? old | bits : old & ~bits;
    }
    this.touched(cells);
  }

  /** Clear bits of all cells. */
  unmarkAll(bits: number): void {
    if (bits & MARK_HIDDEN) this.hasHidden = false;
    for (let cell = 0; cell < this.nCells; cell++) this.texels[4 * cell + 2] &= ~bits;
    this.sendWhole();
  }

  /** Have the texels of these cells sent to the graphics card, and few others. */
  private touched(cells: Uint32Array): void {
    const rows = new Map<number, [number, number]>();
    for (const cell of cells) {
      const span = rows.get(Math.floor(cell / WIDTH));
      if (!span) rows.set(Math.floor(cell / WIDTH), [cell, cell]);
      else if (cell > span[1]) span[1] = cell;
      else if (cell < span[0]) span[0] = cell;
    }
    if (rows.size > MAX_ROWS || this.isWhole) {
      this.sendWhole();
      return;
    }
    for (const [low, high] of rows.values()) {
      this.texture.addUpdateRange(4 * low, 4 * (high - low + 1));
    }
    this.texture.needsUpdate = true;
  }

  private sendWhole(): void {
    this.isWhole = true;
    this.texture.clearUpdateRanges();
    this.texture.needsUpdate = true;
  }

  /** The graphics card has everything. */
  sent(): void {
    this.isWhole = false;
  }
}

/** Per region: its color and whether it is selected; texels change one by one. */
export class RegionTexture {
  readonly texture: DataTexture;
  private readonly texels: Uint8Array;

  constructor(colors: Rgb[]) {
    this.texels = new Uint8Array(4 * WIDTH * rowsOf(colors.length));
    colors.forEach((color, region) => this.texels.set(color, 4 * region));
    this.texture = finished(
      new DataTexture(this.texels, WIDTH, rowsOf(colors.length), RGBAFormat, UnsignedByteType),
    );
  }

  select(regions: Iterable<number>, on: boolean): void {
    for (const region of regions) this.texels[4 * region + 3] = on ? 255 : 0;
    this.texture.needsUpdate = true;
  }
}

/** Per class its color; classes without one are gray. */
export function classTexture(colors: ReadonlyMap<number, Rgb>): DataTexture {
  const highest = Math.min(MAX_CLASSES - 1, Math.max(0, ...colors.keys()));
  const texels = new Uint8Array(4 * WIDTH * rowsOf(highest + 1)).fill(128);
  for (const [id, color] of colors) texels.set(color, 4 * id);
  return finished(
    new DataTexture(texels, WIDTH, rowsOf(highest + 1), RGBAFormat, UnsignedByteType),
  );
}
