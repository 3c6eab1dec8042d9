// Colors of regions, which differ between neighbors, and of classes.

import type { Neighbors } from "./neighbors";

export type Rgb = readonly [number, number, number];

// The palette of superfacets.pictures.colors.
const PALETTE: Rgb[] = [
  [255, 155, 180], [80, 160, 220], [250, 230, 115], [135, 165, 80],
  [190, 140, 220], [255, 170, 95], [165, 250, 195], [220, 115, 135],
  [170, 190, 255], [210, 135, 35], [50, 195, 180], [225, 210, 190],
  [255, 195, 255], [170, 205, 120], [185, 165, 150], [95, 230, 250],
];

// Colors of new classes, in turn. Color-blind people can tell each from the ones beside it.
const CLASS_COLORS = [
  "#e6550d", "#3182bd", "#31a354", "#8856a7", "#d6b300", "#c51b8a", "#1b9e9e", "#8c510a",
  "#636363", "#66a61e", "#e7298a", "#2b3fb0",
];

export function nextClassColor(used: string[]): string {
  const free = CLASS_COLORS.find((color) => !used.includes(color));
  return free ?? CLASS_COLORS[used.length % CLASS_COLORS.length];
}

export function parseColor(text: string): Rgb {
  const value = parseInt(text.slice(1), 16);
  return [value >> 16, (value >> 8) & 255, value & 255];
}

/** For each region the least used color that no neighbor has, if there is one. */
export function regionColors(neighbors: Neighbors, count: number): Rgb[] {
  const chosen = new Int8Array(count).fill(-1);
  const uses = new Uint32Array(PALETTE.length);
  for (let region = 0; region < count; region++) {
    const taken = new Set<number>();
    for (const other of neighbors.of(region)) taken.add(chosen[other]);
    let best = -1;
    for (let color = 0; color < PALETTE.length; color++) {
      if (!taken.has(color) && (best < 0 || uses[color] < uses[best])) best = color;
    }
    chosen[region] = best < 0 ? region % PALETTE.length : best;
    uses[chosen[region]]++;
  }
  return Array.from(chosen, (color) => PALETTE[color]);
}
