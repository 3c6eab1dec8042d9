// Vertex normals, encoded in two bytes each.

import type { Positions } from "./shape";

// Code of a point without a normal, and of a vertex on a crease, where each triangle is shaded with the triangle's normal.
export const NO_NORMAL = 0;
const DOWNWARD = 0xfefe; // code of the downward direction, used instead of 0 because 0 means NO_NORMAL
// Smallest cosine of the angle between a vertex normal and its triangles' normals; for a smaller cosine, the vertex is
// on a crease.
const SMOOTH = 0.9;

/** Octahedral encoding of a direction in two bytes. */
function packDirection(x: number, y: number, z: number): number {
  const sum = Math.abs(x) + Math.abs(y) + Math.abs(z) || 1;
  let a = x / sum;
  let b = y / sum;
  if (z < 0) {
    [a, b] = [(1 - Math.abs(b)) * (a < 0 ? -1 : 1), (1 - Math.abs(a)) * (b < 0 ? -1 : 1)];
  }
  return Math.round((a + 1) * 127) | (Math.round((b + 1) * 127) << 8) || DOWNWARD;
}

/** Encoded mean normal of the triangles around each vertex, or `NO_NORMAL` for a vertex on a crease. */
export function vertexNormals(positions: Positions, triangles: Uint32Array): Uint16Array {
  const sums = new Float32Array(positions.values.length);
  const normal = new Float32Array(3);
  for (let i = 0; i < triangles.length; i += 3) {
    triangleNormal(positions, triangles, i, normal);
    for (let k = 0; k < 9; k++) sums[3 * triangles[i + ((k / 3) | 0)] + (k % 3)] += normal[k % 3];
  }
  const packed = new Uint16Array(sums.length / 3);
  for (let i = 0; i < packed.length; i++) {
    const at = 3 * i;
    const length = Math.sqrt(sums[at] ** 2 + sums[at + 1] ** 2 + sums[at + 2] ** 2) || 1;
    for (let k = 0; k < 3; k++) sums[at + k] /= length;
    packed[i] = packDirection(sums[at], sums[at + 1], sums[at + 2]);
  }
  for (let i = 0; i < triangles.length; i += 3) {
    const least = SMOOTH * triangleNormal(positions, triangles, i, normal);
    for (let k = 0; k < 3; k++) {
      const at = 3 * triangles[i + k];
      const along = normal[0] * sums[at] + normal[1] * sums[at + 1] + normal[2] * sums[at + 2];
      if (along < least) packed[at / 3] = NO_NORMAL;
    }
  }
  return packed;
}

/** Writes the normal of the triangle at `triangles[i..i + 2]` to `into`, and returns its length. */
function triangleNormal(
  { values, step }: Positions, triangles: Uint32Array, i: number, into: Float32Array,
): number {
  const [a, b, c] = [3 * triangles[i], 3 * triangles[i + 1], 3 * triangles[i + 2]];
  const ux = (values[b] - values[a]) * step[0];
  const uy = (values[b + 1] - values[a + 1]) * step[1];
  const uz = (values[b + 2] - values[a + 2]) * step[2];
  const vx = (values[c] - values[a]) * step[0];
  const vy = (values[c + 1] - values[a + 1]) * step[1];
  const vz = (values[c + 2] - values[a + 2]) * step[2];
  into[0] = uy * vz - uz * vy;
  into[1] = uz * vx - ux * vz;
  into[2] = ux * vy - uy * vx;
  return Math.sqrt(into[0] * into[0] + into[1] * into[1] + into[2] * into[2]);
}
