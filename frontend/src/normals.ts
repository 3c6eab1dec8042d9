// Normals of vertices in one number each.

export const NO_NORMAL = 0; // at a crease, where each triangle has its own
const SMOOTH = 0.8; // least cosine between the normals of a vertex and of its triangles

/** A direction in two halves of 16 bits: its place on an octahedron that is folded flat. */
function pack(x: number, y: number, z: number): number {
  const sum = Math.abs(x) + Math.abs(y) + Math.abs(z) || 1;
  let a = x / sum;
  let b = y / sum;
  if (z < 0) {
    [a, b] = [(1 - Math.abs(b)) * (a < 0 ? -1 : 1), (1 - Math.abs(a)) * (b < 0 ? -1 : 1)];
  }
  const low = Math.round((a + 1) * 32767);
  const high = Math.round((b + 1) * 32767);
  return (((high << 16) | low) >>> 0) || 1;
}

/** Directions, three numbers each, packed; (0, 0, 0) is none. */
export function packAll(directions: Float32Array): Uint32Array<ArrayBuffer> {
  const packed = new Uint32Array(directions.length / 3);
  for (let i = 0; i < packed.length; i++) {
    const [x, y, z] = [directions[3 * i], directions[3 * i + 1], directions[3 * i + 2]];
    packed[i] = x || y || z ? pack(x, y, z) : NO_NORMAL;
  }
  return packed;
}

/** The sum of the triangles' normals at each vertex, packed; `NO_NORMAL` where they differ much. */
export function vertexNormals(
  positions: Float32Array, triangles: Uint32Array,
): Uint32Array<ArrayBuffer> {
  const sums = new Float32Array(positions.length);
  const normal = [0, 0, 0];
  for (let i = 0; i < triangles.length; i += 3) {
    triangleNormal(positions, triangles, i, normal);
    for (let k = 0; k < 3; k++) {
      const at = 3 * triangles[i + k];
      sums[at] += normal[0];
      sums[at + 1] += normal[1];
      sums[at + 2] += normal[2];
    }
  }
  const packed = packAll(sums);
  for (let i = 0; i < triangles.length; i += 3) {
    const [x, y, z] = triangleNormal(positions, triangles, i, normal);
    const least = SMOOTH * Math.sqrt(x * x + y * y + z * z);
    for (let k = 0; k < 3; k++) {
      const at = 3 * triangles[i + k];
      const [u, v, w] = [sums[at], sums[at + 1], sums[at + 2]];
      const length = Math.sqrt(u * u + v * v + w * w);
      if (x * u + y * v + z * w < least * length) packed[at / 3] = NO_NORMAL;
    }
  }
  return packed;
}

function triangleNormal(
  positions: Float32Array, triangles: Uint32Array, i: number, into: number[],
): number[] {
  const [a, b, c] = [3 * triangles[i], 3 * triangles[i + 1], 3 * triangles[i + 2]];
  const ux = positions[b] - positions[a];
  const uy = positions[b + 1] - positions[a + 1];
  const uz = positions[b + 2] - positions[a + 2];
  const vx = positions[c] - positions[a];
  const vy = positions[c + 1] - positions[a + 1];
  const vz = positions[c + 2] - positions[a + 2];
  into[0] = uy * vz - uz * vy;
  into[1] = uz * vx - ux * vz;
  into[2] = ux * vy - uy * vx;
  return into;
}
