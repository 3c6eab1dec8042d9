// Colors of regions (neighbors get different colors), and colors of classes.

import type { Neighbors } from "./labeling";

export type Rgb = readonly [number, number, number];

export function parseColor(text: string): Rgb {
  const value = parseInt(text.slice(1), 16);
  return [value >> 16, (value >> 8) & 255, value & 255];
}

export const cssColor = (color: Rgb): string => `rgb(${color.join()})`;

/** For successive objects of a class: share of white (above 0) or black (below 0) in their color. */
export const VARIANTS = [0, 0.5, -0.4, 0.28, -0.22];

/** Color of an object: the color of its class, lighter or darker, as in shaders.ts. */
export function variant(color: Rgb, object: number): Rgb {
  if (object < 2) return color;
  const shift = VARIANTS[(object - 1) % VARIANTS.length];
  const [red, green, blue] = color.map((value) =>
    Math.round(shift > 0 ? value + (255 - value) * shift : value * (1 + shift)),
  );
  return [red, green, blue];
}

/** Gives each region the least used color of the palette that no neighbor has, if there is any. */
// Greedy in the order of labels: after a split, whose new region comes last, nearly all colors stay.
// Python's region_colors chooses better distinguished colors, but a split can change most of them.
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
