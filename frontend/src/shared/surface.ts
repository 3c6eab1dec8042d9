// GPU buffers and textures of a mesh surface or a point cloud.

import type { Eye } from "./camera";
import { type Gpu, type Program, Table, type Values } from "./gl";
import { vertexNormals } from "./normals";
import { NONE, type Positions, type Shape, type ShapeFacts } from "./shape";

export class Surface {
  readonly vertices: Table;
  bufferBytes = 0;
  nCorners = 0;
  private readonly sources: Table;
  private hasSources = false;
  private hasFloats = false;
  private isCloud = false;
  private facts!: ShapeFacts;
  private shape: Shape | null = null; // kept to upload it again after the WebGL context was lost; null if the Gpu keeps no copies
  private state: WebGLVertexArrayObject | null = null;
  private readonly buffers: WebGLBuffer[] = [];

  constructor(protected readonly gpu: Gpu) {
    this.vertices = new Table(gpu);
    this.sources = new Table(gpu);
    gpu.hold(this);
  }

  make(): void {
    if (this.shape) this.show(this.shape);
  }

  /** Upload the geometry. */
  show(shape: Shape): void {
    const { facts, positions, triangles, sources, normals } = shape;
    this.shape = this.gpu.isKept ? shape : null;
    this.facts = facts;
    this.isCloud = triangles === null;
    this.hasSources = sources !== null;
    this.hasFloats = positions.values instanceof Float32Array;
    const packed = triangles ? vertexNormals(positions, triangles) : normals!;
    this.vertices.fill(this.hasFloats ? "rgba32" : "rgba16", vertexTexels(positions, packed));
    this.sources.fill("r32", sources ?? new Uint32Array(1));
    this.sendCorners(triangles, positions.values.length / 3);
  }

  private sendCorners(triangles: Uint32Array | null, nVertices: number): void {
    const { gl, isFirstProvoking } = this.gpu;
    const { vertices, corners } = triangles ? sharedCorners(triangles, nVertices) : points(nVertices);
    for (let i = 0; !isFirstProvoking && i < corners.length; i += 3) {
      corners.set([corners[i + 1], corners[i + 2], corners[i]], i);
    }
    this.nCorners = triangles ? corners.length : nVertices;
    this.bufferBytes = vertices.byteLength + corners.byteLength;
    gl.deleteVertexArray(this.state);
    for (const buffer of this.buffers.splice(0)) gl.deleteBuffer(buffer);
    this.state = gl.createVertexArray();
    gl.bindVertexArray(this.state);
    this.sendBuffer(gl.ARRAY_BUFFER, vertices);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribIPointer(0, 2, gl.UNSIGNED_INT, 0, 0);
    this.sendBuffer(gl.ELEMENT_ARRAY_BUFFER, corners);
  }

  private sendBuffer(kind: GLenum, values: Uint32Array): void {
    const { gl } = this.gpu;
    const buffer = gl.createBuffer();
    this.buffers.push(buffer);
    gl.bindBuffer(kind, buffer);
    gl.bufferData(kind, values, gl.STATIC_DRAW);
  }

  /** Uniforms from which the shaders compute vertex positions. */
  placing(eye: Eye): Values {
    const { facts, vertices, hasFloats } = this;
    return { ...eye, vertices, has_floats: hasFloats, low: facts.low, step_: facts.step };
  }

  /**
   * Draw all triangles or points. `pixels` is the size in pixels of a segment of length 1 at distance 1;
   * `others` are additional uniforms of the program.
   */
  draw(program: Program, eye: Eye, pixels: number, others: Values): void {
    const { gl } = this.gpu;
    program.use({
      ...this.placing(eye), sources: this.sources, has_sources: this.hasSources, is_cloud: this.isCloud,
      point_size: pixels * this.facts.point_size, ...others,
    });
    gl.bindVertexArray(this.state);
    if (this.isCloud) gl.drawArrays(gl.POINTS, 0, this.nCorners);
    else gl.drawElements(gl.TRIANGLES, this.nCorners, gl.UNSIGNED_INT, 0);
  }

  get bytes(): number {
    return this.bufferBytes + this.vertices.bytes + this.sources.bytes;
  }
}

interface Corners {
  vertices: Uint32Array; // two numbers per vertex: its index, and the triangle that has the vertex as first corner
  corners: Uint32Array; // index in `vertices` of each corner, three per triangle
}

function points(nVertices: number): Corners {
  const vertices = new Uint32Array(2 * nVertices);
  for (let i = 0; i < nVertices; i++) vertices[2 * i] = i;
  return { vertices, corners: new Uint32Array(0) };
}

/**
 * Rotates the corners of each triangle so that no two triangles have the same first corner. The
 * first corner therefore identifies the triangle. Vertices are still shared between triangles, so the
 * vertex shader runs only once per vertex. If each corner of a triangle is already the first corner
 * of another triangle, a vertex is duplicated.
 */
function sharedCorners(triangles: Uint32Array, nVertices: number): Corners {
  const n = triangles.length / 3;
  const corners = new Uint32Array(triangles.length);
  const pieces = new Uint32Array(nVertices + n).fill(NONE); // triangle whose first corner is this vertex, or NONE
  const copies = new Uint32Array(n); // original vertex of each duplicate; duplicate i has the index nVertices + i
  let nCopies = 0;
  for (let i = 0; i < n; i++) {
    let first = 0;
    while (first < 3 && pieces[triangles[3 * i + first]] !== NONE) first++;
    const isCopied = first === 3;
    if (isCopied) first = 0;
    for (let k = 0; k < 3; k++) corners[3 * i + k] = triangles[3 * i + ((first + k) % 3)];
    if (isCopied) {
      copies[nCopies] = corners[3 * i];
      corners[3 * i] = nVertices + nCopies++;
    }
    pieces[corners[3 * i]] = i;
  }
  const vertices = new Uint32Array(2 * (nVertices + nCopies));
  for (let i = 0; i < nVertices + nCopies; i++) {
    vertices[2 * i] = i < nVertices ? i : copies[i - nVertices];
    vertices[2 * i + 1] = pieces[i];
  }
  return { vertices, corners };
}

/** Texels of the vertex table: x, y, z (as integers, or as the bits of floats) and the encoded normal. */
function vertexTexels({ values }: Positions, normals: Uint16Array): Uint16Array | Uint32Array {
  const isFloat = values instanceof Float32Array;
  const numbers = isFloat ? new Uint32Array(values.buffer, values.byteOffset, values.length) : values;
  const texels = new (isFloat ? Uint32Array : Uint16Array)((4 * values.length) / 3);
  for (let i = 0; i < normals.length; i++) {
    for (let k = 0; k < 3; k++) texels[4 * i + k] = numbers[3 * i + k];
    texels[4 * i + 3] = normals[i];
  }
  return texels;
}
