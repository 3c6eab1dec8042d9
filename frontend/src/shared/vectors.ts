// Vectors with three components.

export type Vector = [x: number, y: number, z: number];

export const dot = (a: Vector, b: Vector): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

export const lengthOf = (a: Vector): number => Math.sqrt(dot(a, a));

/** a + factor * b. */
export const plus = (a: Vector, b: Vector, factor = 1): Vector => [
  a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2],
];

export const minus = (a: Vector, b: Vector): Vector => plus(a, b, -1);

export const scaled = (a: Vector, factor: number): Vector => [factor * a[0], factor * a[1], factor * a[2]];

export const cross = (a: Vector, b: Vector): Vector => [
  a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0],
];

export interface Sphere {
  middle: Vector;
  radius: number;
}

/** The mean of points, and the largest distance of a point from the mean; null without points. */
export function sphereOf(points: readonly Vector[]): Sphere | null {
  if (!points.length) return null;
  const middle = scaled(points.reduce((sum, point) => plus(sum, point)), 1 / points.length);
  return { middle, radius: points.reduce((most, point) => Math.max(most, lengthOf(minus(point, middle))), 0) };
}

/** The vector scaled to length 1; a zero vector is returned unchanged. */
export const normalized = (a: Vector): Vector => scaled(a, 1 / (lengthOf(a) || 1));
