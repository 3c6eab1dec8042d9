// Colors of regions, where neighbors get different colors, and colors of classes and objects.

import type { Neighbors } from "./labeling";

export type Rgb = readonly [number, number, number];

export function parseColor(text: string): Rgb {
  const value = parseInt(text.slice(1), 16);
  return [value >> 16, (value >> 8) & 255, value & 255];
}

export const cssColor = (color: Rgb): string => `rgb(${color.join()})`;

/**
 * Variations of the class color for successive objects of a class: the fraction of white (positive) or
 * black (negative) that is mixed into the color.
 */
export const VARIANTS = [0, 0.5, -0.4, 0.28, -0.22];

/** Color of an object: a lighter or darker variation of the class color. shaders.ts has the same function. */
export function variant(color: Rgb, object: number): Rgb {
  if (object < 2) return color;
  const shift = VARIANTS[(object - 1) % VARIANTS.length];
  const [red, green, blue] = color.map((value) =>
    Math.round(shift > 0 ? value + (255 - value) * shift : value * (1 + shift)),
  );
  return [red, green, blue];
}

/**
 * Assigns to each region the least used color of the palette that none of its neighbors has. Two neighbors get the same
 * color only if the palette is too small. Regions are colored in the order of their labels. A split appends its new
 * region, so almost all regions keep their color. Python's region_colors finds colors that are easier to distinguish,
 * but after a split most colors can change.
 */
export function regionColors(neighbors: Neighbors, count: number, palette: Rgb[]): Rgb[] {
  const chosen = new Int8Array(count).fill(-1);
  const uses = new Uint32Array(palette.length);
  for (let region = 0; region < count; region++) {
    const taken = new Set<number>();
    for (const other of neighbors.of(region)) taken.add(chosen[other]);
    let best = -1;
    for (let color = 0; color < palette.length; color++) {
      if (!taken.has(color) && (best < 0 || uses[color] < uses[best])) best = color;
    }
    chosen[region] = best < 0 ? region % palette.length : best;
    uses[chosen[region]]++;
  }
  return Array.from(chosen, (color) => palette[color]);
}
