// Colors of regions, where neighbors get different colors, and colors of classes and objects.

import { classOf, type Neighbors, objectOf, type Paints, type Regions } from "./labeling";

export type Rgb = readonly [number, number, number];
type Lab = readonly [lightness: number, a: number, b: number];

export function parseColor(text: string): Rgb {
  const value = parseInt(text.slice(1), 16);
  return [value >> 16, (value >> 8) & 255, value & 255];
}

export const cssColor = (color: Rgb): string => `rgb(${color.join()})`;

export const N_SHADES = 8; // number of shades of a class, for its objects
const N_USUAL = 5; // number of shades that successive objects repeat; other shades are for objects that touch

/** Fractions of white (positive) or black (negative) mixed into the class color, in order of preference. */
const SHIFTS = [0.5, -0.4, 0.28, -0.22, 0.65, -0.55, 0.39, -0.31];

// Wanted distance in CIELAB of a shade to colors of other classes, and to other shades of the class. Larger distances
// are not possible for all of the default colors.
const MIN_TO_CLASSES = 24;
const MIN_TO_SHADES = 10;

function mixed(color: Rgb, shift: number): Rgb {
  const mix = (value: number): number => Math.round(shift > 0 ? value + (255 - value) * shift : value * (1 + shift));
  return [mix(color[0]), mix(color[1]), mix(color[2])];
}

/** CIELAB coordinates of an sRGB color (white point D65). */
function labOf(color: Rgb): Lab {
  const [r, g, b] = color.map((value) => (value > 10 ? ((value / 255 + 0.055) / 1.055) ** 2.4 : value / 255 / 12.92));
  const root = (value: number): number => (value > 0.008856 ? Math.cbrt(value) : 7.787 * value + 16 / 116);
  const x = root((0.4124 * r + 0.3576 * g + 0.1805 * b) / 0.9505);
  const y = root(0.2126 * r + 0.7152 * g + 0.0722 * b);
  const z = root((0.0193 * r + 0.1192 * g + 0.9505 * b) / 1.089);
  return [116 * y - 16, 500 * (x - y), 200 * (y - z)];
}

/**
 * Colors of successive objects of a class: the class color, and lighter and darker shades of it that differ from each
 * other and from the colors of other classes. `others` contains the colors of other classes in CIELAB.
 */
function shadesOf(color: Rgb, others: readonly Lab[]): Rgb[] {
  const shades = [color];
  const own = [labOf(color)];
  const worth = (shift: number): number => {
    const lab = labOf(mixed(color, shift));
    const nearest = (to: readonly Lab[]): number => Math.min(...to.map((one) => Math.hypot(...one.map((value, k) => value - lab[k]))));
    return Math.min(nearest(others) / MIN_TO_CLASSES, nearest(own) / MIN_TO_SHADES);
  };
  while (shades.length < N_SHADES) {
    const best = SHIFTS.find((shift) => worth(shift) >= 1) ?? SHIFTS.reduce((a, b) => (worth(a) >= worth(b) ? a : b));
    shades.push(mixed(color, best));
    own.push(labOf(mixed(color, best)));
  }
  return shades;
}

/** Shades of each class, by class id. Classes with equal colors have equal shades. */
export function shadesOfClasses(classes: readonly { id: number; color: string }[]): Map<number, Rgb[]> {
  const labs = new Map(classes.map(({ color }) => [color, labOf(parseColor(color))]));
  const shades = new Map([...labs.keys()].map((color) => {
    const others = [...labs].filter(([other]) => other !== color).map(([, lab]) => lab);
    return [color, shadesOf(parseColor(color), others)];
  }));
  return new Map(classes.map(({ id, color }) => [id, shades.get(color)!]));
}

/** Shade of an object, as an index, if no object of its class touches it. */
export const usualShade = (object: number): number => Math.max(0, object - 1) % N_USUAL;

/**
 * Shade of each object, by paint; without entry, `usualShade`. Objects of a class in one region, or in adjacent
 * regions, get different shades, unless all are taken. Lower numbers choose first, so a new object changes no other.
 */
export function shadesOfObjects({ of, countOf }: Paints, { labels, neighbors, count }: Regions): Map<number, number> {
  const shades = new Map<number, number>();
  const objects = [...countOf.keys()].filter((paint) => countOf.get(paint)! > 0 && objectOf(paint)).sort((a, b) => a - b);
  if (objects.every((paint) => objectOf(paint) <= N_USUAL)) return shades;
  const inside = Array.from({ length: count }, () => new Set<number>());
  for (let cell = 0; cell < of.length; cell++) if (labels[cell] >= 0 && objectOf(of[cell])) inside[labels[cell]].add(of[cell]);
  const touching = new Map(objects.map((paint) => [paint, new Set<number>()]));
  inside.forEach((own, region) => {
    const near = [own, ...neighbors.of(region).map((other) => inside[other])];
    for (const set of near) for (const other of set) for (const one of own) if (classOf(one) === classOf(other)) touching.get(one)!.add(other);
  });
  for (const paint of objects) {
    const [taken, usual] = [new Set([...touching.get(paint)!].map((other) => shades.get(other))), usualShade(objectOf(paint))];
    const order = Array.from({ length: N_SHADES }, (_, k) => (k < N_USUAL ? (usual + k) % N_USUAL : k));
    shades.set(paint, order.find((one) => !taken.has(one)) ?? usual);
  }
  return shades;
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
