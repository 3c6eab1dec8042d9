"use strict";
// The viewer of a page that `superfacets.view` has written: WebGL 2, no library, no network.
//
// What is drawn lies in textures. A vertex of a triangle is a number: the vertex shader reads its
// position by it. Each cell (face, polygon, tetrahedron or point) has the number of its group, and
// each group a color: one texel. A frame is one call that draws the surface and one for borders;
// nothing is sent for it but a few numbers. What is at each pixel is drawn once for a view, when the
// pointer first asks for it.

// ---------------------------------------------------------------------------------- the payload

const WIDTH = 2048; // of textures: each WebGL 2 has room for it
const NO_GROUP = 0xffffffff; // a cell in no region, or without a value
const NO_NORMAL = 0; // of a corner in a crease, where each triangle has its own
const SMOOTH = 0.9; // least cosine between the normals of a triangle and of a corner that is none
const PLAIN = [205, 197, 184];
const GRAY = [150, 150, 150];
const HALF_ANGLE = (10 * Math.PI) / 180; // of what the height of the page shows
const SLOW_MS = 40; // between frames: a view that moves so slowly is drawn coarsely
const COARSE = 0.5; // pixels of such a view, to one of the screen, along each side
const SAMPLES = 4; // of each pixel of a fine view: coarse ones have one
const REST_MS = 150; // without a change: the view is drawn finely again

function bytesOfBase64(text) {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text);
  const characters = atob(text);
  const bytes = new Uint8Array(characters.length);
  for (let i = 0; i < bytes.length; i++) bytes[i] = characters.charCodeAt(i);
  return bytes;
}

async function inflate(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** The arrays of the payload by name: planes of bytes are joined, differences summed. */
function decodeArrays(bytes, entries) {
  const types = { 1: Uint8Array, 2: Uint16Array, 4: Uint32Array };
  const arrays = {};
  let start = 0;
  for (const { name, size, count, columns, coding } of entries) {
    const values = new types[size](count);
    for (let plane = 0; plane < size; plane++) {
      for (let i = 0, at = start + plane * count; i < count; i++) {
        values[i] |= bytes[at + i] << (8 * plane);
      }
    }
    start += size * count;
    if (coding === "difference") sumColumns(values, count / columns);
    if (coding === "newest") numbersOfCodes(values);
    arrays[name] = values;
  }
  return arrays;
}

function sumColumns(values, length) {
  for (let i = 0; i < values.length; i++) if (i % length) values[i] += values[i - 1];
}

/** 0 stands for the next number that has not been there yet, k for the k-th last that has. */
function numbersOfCodes(values) {
  let next = 0;
  for (let i = 0; i < values.length; i++) {
    const code = values[i];
    values[i] = next - code;
    if (code === 0) next++;
  }
}

// -------------------------------------------------------------------------------------- shaders

const SHARED = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp usampler2D;
ivec2 place(uint i) { return ivec2(int(i % ${WIDTH}u), int(i / ${WIDTH}u)); }
`;

const POSITIONS = `
uniform usampler2D positions;  // x, y, z; and the normal in two bytes
uniform vec3 low;
uniform vec3 step_;
uniform mat3 turn;  // from the mesh to the eye
uniform vec3 target;
uniform float distance_;
uniform mat4 projection;
vec3 seen(uvec4 texel) {
  return turn * (low + step_ * vec3(texel.xyz) - target) - vec3(0.0, 0.0, distance_);
}
`;

const SURFACE = `${SHARED}${POSITIONS}
in uvec2 vertex;  // number, and the triangle whose first vertex it is
uniform usampler2D sources;  // the cell of each triangle, where those are not the cells
uniform bool has_sources;
uniform bool is_cloud;
uniform float point_size;  // pixels at distance 1
flat out uint cell;
out vec3 at;
out vec3 normal;  // none in a crease
out float smoothness;  // 0 in a crease
vec3 unpacked(uint bits) {
  vec2 xy = vec2(bits & 255u, bits >> 8) / 127.0 - 1.0;
  vec3 v = vec3(xy, 1.0 - abs(xy.x) - abs(xy.y));
  if (v.z < 0.0) v.xy = (1.0 - abs(v.yx)) * vec2(v.x < 0.0 ? -1.0 : 1.0, v.y < 0.0 ? -1.0 : 1.0);
  return normalize(v);
}
void main() {
  uint piece = is_cloud ? vertex.x : vertex.y;
  cell = has_sources ? texelFetch(sources, place(piece), 0).r : piece;
  uvec4 texel = texelFetch(positions, place(vertex.x), 0);
  at = seen(texel);
  bool has_normal = is_cloud || texel.w != ${NO_NORMAL}u;
  normal = has_normal ? turn * unpacked(texel.w) : vec3(0.0);
  smoothness = has_normal ? 1.0 : 0.0;
  gl_Position = projection * vec4(at, 1.0);
  gl_PointSize = max(1.0, point_size / -at.z);
}`;

const SHADE = `${SHARED}
uniform usampler2D groups;  // of each cell
uniform sampler2D colors;  // of each group
uniform usampler2D regions;  // of each cell
uniform vec3 missing;  // the color where there is no group
uniform uint marked;  // region under the pointer
uniform bool is_cloud;
flat in uint cell;
in vec3 at;
in vec3 normal;
in float smoothness;
out vec4 color;
void main() {
  uint group = texelFetch(groups, place(cell), 0).r;
  vec3 base = group == ${NO_GROUP}u ? missing : texelFetch(colors, place(group), 0).rgb;
  vec3 toward = normalize(-at);
  vec3 flat_ = is_cloud ? normalize(normal) : normalize(cross(dFdx(at), dFdy(at)));
  flat_ = dot(flat_, toward) < 0.0 ? -flat_ : flat_;
  vec3 bent = dot(flat_, normal) < 0.0 ? -normal : normal;
  vec3 shading = normalize(bent + max(0.0, 1.0 - smoothness) * flat_);
  float key = max(0.0, dot(shading, normalize(vec3(0.4, 0.55, 0.75))));
  float light = 0.42 + 0.48 * key + 0.16 * max(0.0, dot(shading, toward));
  if (texelFetch(regions, place(cell), 0).r == marked && marked != ${NO_GROUP}u) {
    base = mix(base, vec3(1.0), 0.45);
  }
  color = vec4(min(base * light, 1.0), 1.0);
}`;

const PICK = `${SHARED}
flat in uint cell;
out uint found;
void main() { found = cell + 1u; }`;

// A border is a rectangle on the screen. Where both sides are of one region it is none at all.
const BORDER = `${SHARED}${POSITIONS}
uniform usampler2D edges;  // two vertices, and the cells on either side
uniform usampler2D regions;
uniform vec2 frame;  // pixels
uniform float line_width;  // pixels
void main() {
  uvec4 edge = texelFetch(edges, place(uint(gl_VertexID / 6)), 0);
  int corner = gl_VertexID % 6;  // of two triangles: 0 1 2, 2 1 3
  corner = corner < 3 ? corner : corner == 3 ? 2 : corner == 4 ? 1 : 3;
  uint left = texelFetch(regions, place(edge.z), 0).r;
  uint right = texelFetch(regions, place(edge.w), 0).r;
  gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
  if (left == right) return;
  vec3 a = seen(texelFetch(positions, place(edge.x), 0));
  vec3 b = seen(texelFetch(positions, place(edge.y), 0));
  float pixel = 2.0 / (projection[1][1] * frame.y);  // at distance 1
  a *= 1.0 - 1.2 * line_width * pixel;
  b *= 1.0 - 1.2 * line_width * pixel;
  vec4 from = projection * vec4(a, 1.0);
  vec4 to = projection * vec4(b, 1.0);
  if (from.w <= 0.0 || to.w <= 0.0) return;
  vec2 along = (to.xy / to.w - from.xy / from.w) * frame;
  along = length(along) > 0.0 ? normalize(along) : vec2(1.0, 0.0);
  float end = (corner & 1) == 0 ? -1.0 : 1.0;
  float side = (corner & 2) == 0 ? -1.0 : 1.0;
  vec4 place_ = end < 0.0 ? from : to;
  vec2 shift = line_width * (0.35 * end * along + side * vec2(-along.y, along.x));
  gl_Position = place_ + vec4(shift / frame * place_.w, 0.0, 0.0);
}`;

const INK = `${SHARED}
out vec4 color;
void main() { color = vec4(0.11, 0.11, 0.12, 1.0); }`;

// ------------------------------------------------------------------------------ textures, camera

function compile(gl, vertex, fragment) {
  const program = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) {
      throw new Error(gl.getShaderInfoLog(shader));
    }
    gl.attachShader(program, shader);
  }
  gl.bindAttribLocation(program, 0, "vertex");
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
    throw new Error(gl.getProgramInfoLog(program));
  }
  const places = {};
  const uniform = (name) => (places[name] ??= gl.getUniformLocation(program, name));
  return { program, uniform };
}

/** Fill a texture, WIDTH texels wide, with one or four numbers a texel; returns its bytes. */
function fillTexture(gl, unit, format, values) {
  const formats = {
    r32: [gl.R32UI, gl.RED_INTEGER, gl.UNSIGNED_INT, 1, Uint32Array],
    rgba32: [gl.RGBA32UI, gl.RGBA_INTEGER, gl.UNSIGNED_INT, 4, Uint32Array],
    rgba16: [gl.RGBA16UI, gl.RGBA_INTEGER, gl.UNSIGNED_SHORT, 4, Uint16Array],
    rgba8: [gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE, 4, Uint8Array],
  };
  const [inner, outer, type, channels, Numbers] = formats[format];
  const rows = Math.max(1, Math.ceil(values.length / channels / WIDTH));
  if (rows > gl.getParameter(gl.MAX_TEXTURE_SIZE)) {
    throw new Error("the mesh is too large for this graphics card");
  }
  const padded = new Numbers(rows * WIDTH * channels);
  padded.set(values);
  gl.activeTexture(gl.TEXTURE0 + unit);
  gl.texImage2D(gl.TEXTURE_2D, 0, inner, WIDTH, rows, 0, outer, type, padded);
  return padded.byteLength;
}

function makeTexture(gl, unit) {
  gl.activeTexture(gl.TEXTURE0 + unit);
  gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
  for (const name of ["TEXTURE_MIN_FILTER", "TEXTURE_MAG_FILTER"]) {
    gl.texParameteri(gl.TEXTURE_2D, gl[name], gl.NEAREST);
  }
  for (const name of ["TEXTURE_WRAP_S", "TEXTURE_WRAP_T"]) {
    gl.texParameteri(gl.TEXTURE_2D, gl[name], gl.CLAMP_TO_EDGE);
  }
}

/** Two bytes for a direction: its place on an octahedron that is folded flat. */
function packDirection(x, y, z) {
  const sum = Math.abs(x) + Math.abs(y) + Math.abs(z) || 1;
  let a = x / sum;
  let b = y / sum;
  if (z < 0) {
    [a, b] = [(1 - Math.abs(b)) * (a < 0 ? -1 : 1), (1 - Math.abs(a)) * (b < 0 ? -1 : 1)];
  }
  return Math.round((a + 1) * 127) | (Math.round((b + 1) * 127) << 8);
}

/** Normals of vertices, packed: sums of those of triangles, or NO_NORMAL where they differ much. */
function vertexNormals(positions, triangles, [dx, dy, dz]) {
  const n = positions.length / 3;
  const sums = new Float32Array(3 * n);
  const [u, v, normal] = [new Float32Array(3), new Float32Array(3), new Float32Array(3)];
  const side = (into, a, b) => {
    into[0] = (positions[b] - positions[a]) * dx;
    into[1] = (positions[n + b] - positions[n + a]) * dy;
    into[2] = (positions[2 * n + b] - positions[2 * n + a]) * dz;
  };
  const measure = (i) => {
    side(u, triangles[i], triangles[i + 1]);
    side(v, triangles[i], triangles[i + 2]);
    normal[0] = u[1] * v[2] - u[2] * v[1];
    normal[1] = u[2] * v[0] - u[0] * v[2];
    normal[2] = u[0] * v[1] - u[1] * v[0];
    return Math.hypot(normal[0], normal[1], normal[2]);
  };
  for (let i = 0; i < triangles.length; i += 3) {
    measure(i);
    for (let k = 0; k < 9; k++) sums[3 * triangles[i + ((k / 3) | 0)] + (k % 3)] += normal[k % 3];
  }
  const packed = new Uint16Array(n);
  for (let i = 0; i < n; i++) {
    const length = Math.hypot(sums[3 * i], sums[3 * i + 1], sums[3 * i + 2]) || 1;
    for (let k = 0; k < 3; k++) sums[3 * i + k] /= length;
    packed[i] = packDirection(sums[3 * i], sums[3 * i + 1], sums[3 * i + 2]) || 0xfefe; // the same
  }
  for (let i = 0; i < triangles.length; i += 3) {
    const least = SMOOTH * measure(i);
    for (let k = 0; k < 3; k++) {
      const at = 3 * triangles[i + k];
      const along = normal[0] * sums[at] + normal[1] * sums[at + 1] + normal[2] * sums[at + 2];
      if (along < least) packed[at / 3] = NO_NORMAL;
    }
  }
  return packed;
}

/**
 * Corners of triangles such that each triangle begins with one that no other triangle begins with:
 * its number tells the cell. Corners are shared otherwise, so that a vertex is computed once for
 * several triangles. A vertex that begins more than one comes several times.
 */
function sharedCorners(triangles, nVertices) {
  const n = triangles.length / 3;
  const corners = new Uint32Array(triangles.length);
  const pieces = new Uint32Array(nVertices + n).fill(NO_GROUP); // that each corner begins
  const copies = new Uint32Array(n); // the vertices of corners from nVertices on
  let nCopies = 0;
  for (let i = 0; i < n; i++) {
    let first = 0;
    while (first < 3 && pieces[triangles[3 * i + first]] !== NO_GROUP) first++;
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
  return { corners, vertices };
}

/** Positions and normals, four numbers a vertex. */
function vertexTexels(positions, normals) {
  const n = positions.length / 3;
  const texels = new Uint16Array(4 * n);
  for (let i = 0; i < n; i++) {
    texels[4 * i] = positions[i];
    texels[4 * i + 1] = positions[n + i];
    texels[4 * i + 2] = positions[2 * n + i];
    texels[4 * i + 3] = normals[i];
  }
  return texels;
}

/** The eye looks at `target` from `distance`; a mesh has a diagonal of 1, around the origin. */
class Camera {
  constructor(axes, { azimuth, elevation, zoom }) {
    this.axes = axes; // rows: right, up, toward the viewer at azimuth 0
    this.start = { azimuth, elevation, zoom };
    this.reset();
  }

  reset() {
    this.azimuth = (this.start.azimuth * Math.PI) / 180;
    this.elevation = (this.start.elevation * Math.PI) / 180;
    this.target = [0, 0, 0];
    this.fitted = null; // the distance at which all is seen
    this.zoom = this.start.zoom;
  }

  get distance() {
    return this.fitted / this.zoom;
  }

  /** Rows right, up and toward the viewer, in the axes of the mesh. */
  get rows() {
    const [right, up, front] = this.axes;
    const [s, c] = [Math.sin(this.azimuth), Math.cos(this.azimuth)];
    const [t, d] = [Math.sin(this.elevation), Math.cos(this.elevation)];
    const mix = (x, y, z) => [0, 1, 2].map((i) => x * right[i] + y * up[i] + z * front[i]);
    return [mix(c, 0, -s), mix(-s * t, d, -c * t), mix(s * d, t, c * d)];
  }

  /** Go so far away that all positions are on the page. */
  fit(positions, low, step, aspect) {
    const n = positions.length / 3;
    const rows = this.rows.map((row) => row.map((value, k) => value * step[k]));
    const offsets = this.rows.map((row) => row.reduce((sum, value, k) => sum + value * low[k], 0));
    const reach = 1 / (Math.tan(HALF_ANGLE) * 0.94);
    let farthest = 1e-6;
    for (let i = 0; i < n; i++) {
      const [x, y, z] = [positions[i], positions[n + i], positions[2 * n + i]];
      const across = rows[0][0] * x + rows[0][1] * y + rows[0][2] * z + offsets[0];
      const height = rows[1][0] * x + rows[1][1] * y + rows[1][2] * z + offsets[1];
      const depth = rows[2][0] * x + rows[2][1] * y + rows[2][2] * z + offsets[2];
      const needed = Math.max(Math.abs(height), Math.abs(across) / aspect) * reach;
      if (depth + needed > farthest) farthest = depth + needed;
    }
    this.fitted = farthest;
  }

  orbit(x, y) {
    this.azimuth -= x;
    this.elevation = Math.max(-Math.PI / 2, Math.min(Math.PI / 2, this.elevation + y));
  }

  /** Move what is seen by a share of the page's height. */
  pan(x, y) {
    const [right, up] = this.rows;
    const height = 2 * Math.tan(HALF_ANGLE) * this.distance;
    this.target = this.target.map((t, k) => t - height * (x * right[k] - y * up[k]));
  }

  zoomBy(factor) {
    this.zoom = Math.max(0.1, Math.min(200, this.zoom * factor));
  }

  projection(aspect) {
    const far = this.distance + 0.6 + Math.hypot(...this.target);
    const near = Math.max(this.distance - 0.6 - Math.hypot(...this.target), far / 2000);
    const slope = 1 / Math.tan(HALF_ANGLE);
    const depth = (far + near) / (near - far);
    const shift = (2 * far * near) / (near - far);
    return [slope / aspect, 0, 0, 0, 0, slope, 0, 0, 0, 0, depth, -1, 0, 0, shift, 0];
  }
}

// ------------------------------------------------------------------------------- what is drawn

const UNIT = { positions: 0, sources: 1, groups: 2, regions: 3, colors: 4, edges: 5 };

/** Draws the mesh or cloud in the colors of groups, with borders; tells what is at a pixel. */
class Drawing {
  constructor(canvas, facts, arrays) {
    const gl = canvas.getContext("webgl2", { antialias: false, powerPreference: "high-performance" });
    if (!gl) throw new Error("this browser has no WebGL 2");
    Object.assign(this, { gl, canvas, facts, arrays, marked: NO_GROUP, borders: true });
    this.camera = new Camera(facts.axes, facts.view);
    this.stats = { frames: 0, picks: 0, calls: 0, sentBytes: 0, scriptMs: 0 };
    this.bufferBytes = 0;
    this.firstCorner = gl.getExtension("WEBGL_provoking_vertex");
    this.firstCorner?.provokingVertexWEBGL(this.firstCorner.FIRST_VERTEX_CONVENTION_WEBGL);
    this.surface = compile(gl, SURFACE, SHADE);
    this.picker = compile(gl, SURFACE, PICK);
    this.border = compile(gl, BORDER, INK);
    for (const unit of Object.values(UNIT)) makeTexture(gl, unit);
    this.missing = PLAIN;
    this.lineWidth = () => 1;
    this.upload();
    gl.enable(gl.DEPTH_TEST);
    gl.clearColor(0, 0, 0, 0);
  }

  upload() {
    const { arrays, facts } = this;
    const triangles = arrays.triangles ?? new Uint32Array(0);
    const normals = arrays.normals ?? vertexNormals(arrays.positions, triangles, facts.step);
    this.fill(UNIT.positions, "rgba16", vertexTexels(arrays.positions, normals));
    this.fill(UNIT.sources, "r32", arrays.sources ?? new Uint32Array(1));
    this.uploadCorners(triangles, arrays.positions.length / 3);
    const edges = arrays.edges ?? new Uint32Array(0);
    this.n_edges = edges.length / 4;
    const rows = new Uint32Array(edges.length);
    for (let i = 0; i < this.n_edges; i++) {
      for (let k = 0; k < 4; k++) rows[4 * i + k] = edges[k * this.n_edges + i];
    }
    this.fill(UNIT.edges, "rgba32", rows);
    this.nothing = this.gl.createVertexArray(); // edges come by their numbers
    for (const name of ["triangles", "edges", "normals"]) delete arrays[name]; // they are sent
  }

  uploadCorners(triangles, nVertices) {
    const { gl } = this;
    if (this.facts.kind === "cloud") {
      const all = new Uint32Array(2 * nVertices);
      for (let i = 0; i < nVertices; i++) all[2 * i] = i;
      this.n_corners = nVertices;
      this.corners = this.attribute(all, 2);
      return;
    }
    const { corners, vertices } = sharedCorners(triangles, nVertices);
    if (!this.firstCorner) { // the last one tells the cell
      for (let i = 0; i < corners.length; i += 3) {
        corners.set([corners[i + 1], corners[i + 2], corners[i]], i);
      }
    }
    this.n_corners = corners.length;
    this.corners = this.attribute(vertices, 2);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, corners, gl.STATIC_DRAW);
    this.bufferBytes += corners.byteLength;
  }

  attribute(values, size) {
    const { gl } = this;
    const state = gl.createVertexArray();
    gl.bindVertexArray(state);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
    this.bufferBytes += values.byteLength;
    gl.enableVertexAttribArray(0);
    gl.vertexAttribIPointer(0, size, gl.UNSIGNED_INT, 0, 0);
    return state;
  }

  /** Fill a texture, and note how many bytes it has. */
  fill(unit, format, values) {
    this.textureBytes ??= {};
    this.textureBytes[unit] = fillTexture(this.gl, unit, format, values);
    this.stats.sentBytes += this.textureBytes[unit];
  }

  /** Bytes of buffers and textures, without those of the canvas. */
  get gpuBytes() {
    return Object.values(this.textureBytes).reduce((sum, bytes) => sum + bytes, this.bufferBytes);
  }

  /** The region of each cell, between which borders lie. */
  setRegions(labels) {
    this.fill(UNIT.regions, "r32", labels);
    this.request();
  }

  /** The group of each cell, the colors of groups (three bytes each), and that of none. */
  setGroups(groups, colors, missing) {
    this.fill(UNIT.groups, "r32", groups);
    const texels = new Uint8Array((colors.length / 3) * 4).fill(255);
    for (let i = 0; i < colors.length / 3; i++) texels.set(colors.subarray(3 * i, 3 * i + 3), 4 * i);
    this.fill(UNIT.colors, "rgba8", texels);
    this.missing = missing;
    this.request();
  }

  /** Change the color of one group: one texel. */
  setColor(group, [red, green, blue]) {
    const { gl } = this;
    gl.activeTexture(gl.TEXTURE0 + UNIT.colors);
    const [x, y] = [group % WIDTH, Math.floor(group / WIDTH)];
    const texel = new Uint8Array([red, green, blue, 255]);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, x, y, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, texel);
    this.request();
  }

  resize() {
    const ratio = (window.devicePixelRatio || 1) * (this.isCoarse ? COARSE : 1);
    const width = Math.max(1, Math.round(this.canvas.clientWidth * ratio));
    const height = Math.max(1, Math.round(this.canvas.clientHeight * ratio));
    if (this.canvas.width !== width || this.canvas.height !== height) {
      Object.assign(this.canvas, { width, height });
    }
    return { width, height, ratio };
  }

  request() {
    this.waiting ??= requestAnimationFrame((start) => {
      this.waiting = null;
      this.draw();
      requestAnimationFrame((next) => this.noteFrame(next - start));
    });
  }

  /** How long fine frames take, on average; the first, which shaders are made for, does not count. */
  noteFrame(ms) {
    if (this.isCoarse) return;
    if (this.frameMs === undefined) this.frameMs = 0;
    else this.frameMs = (this.frameMs + ms) / 2;
  }

  /** The view changes: draw it, coarsely as long as it moves if fine frames take long. */
  move() {
    this.isCoarse ||= this.frameMs > SLOW_MS;
    clearTimeout(this.resting);
    this.resting = setTimeout(() => this.rest(), REST_MS);
    this.request();
  }

  rest() {
    if (!this.isCoarse) return;
    this.isCoarse = false;
    this.request();
  }

  useProgram({ program, uniform }, { width, height }) {
    const { gl, camera, facts } = this;
    gl.useProgram(program);
    gl.uniform1i(uniform("positions"), UNIT.positions);
    gl.uniform1i(uniform("regions"), UNIT.regions);
    gl.uniform3fv(uniform("low"), facts.low);
    gl.uniform3fv(uniform("step_"), facts.step);
    gl.uniformMatrix3fv(uniform("turn"), true, camera.rows.flat());
    gl.uniform3fv(uniform("target"), camera.target);
    gl.uniform1f(uniform("distance_"), camera.distance);
    gl.uniformMatrix4fv(uniform("projection"), false, camera.projection(width / height));
  }

  drawSurface(shader, frame) {
    const { gl, facts } = this;
    const isCloud = facts.kind === "cloud";
    this.useProgram(shader, frame);
    gl.uniform1i(shader.uniform("sources"), UNIT.sources);
    gl.uniform1i(shader.uniform("has_sources"), this.arrays.sources ? 1 : 0);
    gl.uniform1i(shader.uniform("is_cloud"), isCloud ? 1 : 0);
    const pixels = frame.height / (2 * Math.tan(HALF_ANGLE));
    gl.uniform1f(shader.uniform("point_size"), facts.point_size * pixels);
    gl.uniform1i(shader.uniform("groups"), UNIT.groups);
    gl.uniform1i(shader.uniform("colors"), UNIT.colors);
    gl.uniform3fv(shader.uniform("missing"), this.missing.map((value) => value / 255));
    gl.uniform1ui(shader.uniform("marked"), this.marked);
    gl.bindVertexArray(this.corners);
    this.stats.calls++;
    if (isCloud) gl.drawArrays(gl.POINTS, 0, this.n_corners);
    else gl.drawElements(gl.TRIANGLES, this.n_corners, gl.UNSIGNED_INT, 0);
  }

  drawBorders(frame) {
    const { gl, border } = this;
    this.useProgram(border, frame);
    gl.uniform2f(border.uniform("frame"), frame.width, frame.height);
    const pixels = frame.height / (2 * Math.tan(HALF_ANGLE) * this.camera.distance);
    const width = this.lineWidth(pixels / frame.ratio, frame.height / frame.ratio);
    gl.uniform1f(border.uniform("line_width"), width * frame.ratio);
    gl.uniform1i(border.uniform("edges"), UNIT.edges);
    gl.bindVertexArray(this.nothing);
    this.stats.calls++;
    gl.drawArrays(gl.TRIANGLES, 0, 6 * this.n_edges);
  }

  draw() {
    const { gl, camera, arrays, facts } = this;
    const start = performance.now();
    const frame = this.resize();
    if (camera.fitted === null) {
      camera.fit(arrays.positions, facts.low, facts.step, frame.width / frame.height);
    }
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.isCoarse ? null : this.fineFrame(frame));
    gl.viewport(0, 0, frame.width, frame.height);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    this.drawSurface(this.surface, frame);
    if (this.borders && this.n_edges) this.drawBorders(frame);
    if (!this.isCoarse) this.showFine(frame);
    this.stats.frames++;
    this.stats.scriptMs += performance.now() - start;
  }

  /** A frame with several samples of each pixel. */
  fineFrame(frame) {
    const { gl } = this;
    const samples = Math.min(SAMPLES, gl.getParameter(gl.MAX_SAMPLES));
    this.fine = this.sizedFrame(this.fine, frame, gl.RGBA8, samples);
    return this.fine.target;
  }

  /** The mean of the samples of each pixel goes to the canvas. */
  showFine({ width, height }) {
    const { gl } = this;
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, this.fine.target);
    gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, null);
    const all = [0, 0, width, height];
    gl.blitFramebuffer(...all, ...all, gl.COLOR_BUFFER_BIT, gl.NEAREST);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  }

  /** A frame of a format beside the canvas: the one there is, if it has the right size. */
  sizedFrame(made, { width, height }, format, samples) {
    const { gl } = this;
    if (made?.width === width && made.height === height) return made;
    const target = made?.target ?? gl.createFramebuffer();
    const buffers = made?.buffers ?? [gl.createRenderbuffer(), gl.createRenderbuffer()];
    gl.bindFramebuffer(gl.FRAMEBUFFER, target);
    const places = [gl.COLOR_ATTACHMENT0, gl.DEPTH_ATTACHMENT];
    [format, gl.DEPTH_COMPONENT24].forEach((inner, i) => {
      gl.bindRenderbuffer(gl.RENDERBUFFER, buffers[i]);
      gl.renderbufferStorageMultisample(gl.RENDERBUFFER, samples, inner, width, height);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, places[i], gl.RENDERBUFFER, buffers[i]);
    });
    return { target, buffers, width, height };
  }

  /** Draw which cell is at each pixel, unless it is known for this view. */
  drawCells(frame) {
    const { gl, camera } = this;
    const { width, height } = frame;
    const view = [width, height, camera.distance, ...camera.target, ...camera.rows.flat()].join();
    this.picked = this.sizedFrame(this.picked, frame, gl.R32UI, 0);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.picked.target);
    if (view === this.pickedView) return;
    gl.viewport(0, 0, width, height);
    gl.clearBufferuiv(gl.COLOR, 0, [0, 0, 0, 0]);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    this.drawSurface(this.picker, frame);
    this.stats.picks++;
    this.pickedView = view;
  }

  /** The cell at a place of the canvas, in CSS pixels; null where there is none. */
  cellAt(x, y) {
    const { gl } = this;
    if (this.camera.fitted === null || this.isCoarse) {
      this.isCoarse = false;
      this.draw();
    }
    const frame = this.resize();
    this.drawCells(frame);
    const [left, top] = [Math.floor(x * frame.ratio), Math.floor(y * frame.ratio)];
    const found = new Uint32Array(4);
    gl.readPixels(left, frame.height - 1 - top, 1, 1, gl.RGBA_INTEGER, gl.UNSIGNED_INT, found);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    return found[0] ? found[0] - 1 : null;
  }
}

// ------------------------------------------------------------------------- labels, values, colors

/** The labels of each level and of the ground truth, and the values that cells can be colored by. */
class Content {
  constructor(facts, arrays) {
    Object.assign(this, { facts, arrays });
    this.levels = facts.levels.map((level, i) => this.labeling(level, `level_${i}`));
    this.truth = facts.truth && this.labeling(facts.truth, "truth");
    this.colorings = [];
    if (this.levels.length) this.colorings.push({ kind: "level", name: "Regions" });
    if (this.truth) this.colorings.push({ kind: "truth", name: "Ground truth" });
    facts.features.forEach((feature, i) => {
      this.colorings.push({ kind: "feature", name: feature.name, feature, i });
    });
    if (!this.colorings.length) this.colorings.push({ kind: "plain", name: "Plain" });
  }

  labeling(facts, name) {
    const { arrays } = this;
    const take = (part) => arrays[`${name}_${part}`];
    return {
      ...facts, name,
      colors: take("colors"), counts: take("counts"),
      sizes: new Float32Array(take("sizes").buffer),
    };
  }

  /** The label of each cell. Levels whose regions are unions of the first's come as its parents. */
  labelsOf(labeling) {
    const given = this.arrays[`${labeling.name}_labels`];
    if (given) return given;
    if (this.last?.name === labeling.name) return this.last.labels;
    const parents = this.arrays[`${labeling.name}_parents`];
    const labels = this.arrays.level_0_labels.map((region) =>
      region === NO_GROUP ? NO_GROUP : parents[region]);
    this.last = { name: labeling.name, labels };
    return labels;
  }

  /** The group of each cell and the colors of groups, for values in 256 steps. */
  groupsOfFeature({ feature, i }) {
    const values = this.arrays[`feature_${i}`];
    const steps = Uint32Array.from(values, (value) => (value === 65535 ? NO_GROUP : value >> 8));
    if (feature.of === "cell") return steps;
    const base = this.arrays.level_0_labels;
    return base.map((region) => (region === NO_GROUP ? NO_GROUP : steps[region]));
  }

  /** The value of a cell; null where it has none. */
  valueOf({ feature, i }, cell) {
    const place = feature.of === "cell" ? cell : this.arrays.level_0_labels[cell];
    const value = place === NO_GROUP ? 65535 : this.arrays[`feature_${i}`][place];
    return value === 65535 ? null : feature.low + ((feature.high - feature.low) * value) / 65534;
  }
}

// ------------------------------------------------------------------------------------- the page

const byId = (id) => document.getElementById(id);
const number = (value) => {
  const size = Math.abs(value);
  if (size && (size < 1e-4 || size >= 1e9)) return value.toExponential(3);
  return value.toLocaleString("en", { maximumSignificantDigits: 4 });
};
const counted = (n, noun) => `${n.toLocaleString("en")} ${noun}${n === 1 ? "" : "s"}`;

class Page {
  constructor(facts, arrays) {
    this.facts = facts;
    this.content = new Content(facts, arrays);
    this.drawing = new Drawing(byId("canvas"), facts, arrays);
    this.drawing.lineWidth = (pixels, height) => this.lineWidth(pixels, height);
    this.coloring = this.content.colorings[0];
    this.level = 0;
    this.fillControls();
    this.connectPointer();
    this.connectKeys();
    new ResizeObserver(() => this.drawing.request()).observe(byId("canvas"));
    this.show();
  }

  /** The labels whose borders are drawn, and that the pointer tells of; null where there are none. */
  get labeling() {
    if (this.coloring.kind === "truth") return this.content.truth;
    return this.content.levels[this.level] ?? this.content.truth;
  }

  /** In CSS pixels: 2 % of the diameter of a region of mean size, and never broken into dots. */
  lineWidth(pixels, height) {
    const area = this.labeling?.mean_area ?? 0;
    const diameter = Math.sqrt((4 * area) / Math.PI) * pixels;
    return Math.max(0.6, Math.min(Math.max(1, height / 450), 0.02 * diameter));
  }

  fillControls() {
    const { content } = this;
    content.colorings.forEach(({ name }, i) => byId("coloring").add(new Option(name, i)));
    byId("coloring").addEventListener("change", (event) => this.setColoring(+event.target.value));
    byId("coloring-row").hidden = content.colorings.length < 2;
    byId("level").max = Math.max(0, content.levels.length - 1);
    byId("level").addEventListener("input", (event) => this.setLevel(+event.target.value));
    byId("level-row").hidden = content.levels.length < 2;
    byId("borders-row").hidden = !this.drawing.n_edges;
    byId("borders").addEventListener("change", (event) => this.setBorders(event.target.checked));
    byId("reset").addEventListener("click", () => this.reset());
    byId("theme").addEventListener("click", () => this.switchTheme());
  }

  setColoring(i) {
    this.coloring = this.content.colorings[i];
    byId("coloring").value = i;
    this.show();
  }

  setLevel(level) {
    this.level = Math.max(0, Math.min(this.content.levels.length - 1, level));
    byId("level").value = this.level;
    this.show();
  }

  setBorders(shown) {
    this.drawing.borders = byId("borders").checked = shown;
    this.drawing.request();
  }

  reset() {
    this.drawing.camera.reset();
    this.drawing.request();
  }

  switchTheme() {
    const isDark = getComputedStyle(document.documentElement).colorScheme === "dark";
    document.documentElement.dataset.theme = isDark ? "light" : "dark";
  }

  /** Draw the coloring and the level that are chosen, and say which. */
  show() {
    const { content, coloring, labeling, drawing } = this;
    const none = new Uint32Array(labeling ? 0 : this.facts.n_cells).fill(NO_GROUP);
    const labels = labeling ? content.labelsOf(labeling) : none;
    drawing.marked = NO_GROUP;
    drawing.setRegions(labels);
    if (coloring.kind === "feature") {
      drawing.setGroups(content.groupsOfFeature(coloring), content.arrays.scale, GRAY);
    } else if (coloring.kind === "plain") {
      drawing.setGroups(labels, new Uint8Array(3), PLAIN);
    } else {
      drawing.setGroups(labels, labeling.colors, GRAY);
    }
    this.describe();
    this.tell(null);
  }

  describe() {
    const { coloring, labeling, content, facts } = this;
    const isFeature = coloring.kind === "feature";
    const n = labeling ? labeling.counts.length : 0;
    byId("level-text").textContent =
      content.levels.length > 1 ? counted(content.levels[this.level].counts.length, "region") : "";
    byId("level").setAttribute("aria-valuetext", byId("level-text").textContent);
    byId("scale").hidden = !isFeature;
    if (isFeature) {
      byId("scale-name").textContent = coloring.name;
      byId("scale-low").textContent = number(coloring.feature.low);
      byId("scale-high").textContent = number(coloring.feature.high);
      byId("scale-bar").style.background = `linear-gradient(to right, ${this.scaleStops()})`;
    }
    const isGray = isFeature ? coloring.feature.n_missing : labeling?.n_left_out;
    byId("gray").hidden = !isGray;
    byId("gray-text").textContent = isFeature
      ? `${counted(isGray, coloring.feature.of === "cell" ? facts.noun : "region")} without a value`
      : `${counted(isGray ?? 0, facts.noun)} in no region`;
    byId("regions").hidden = isFeature || !labeling;
    const noun = coloring.kind === "truth" ? "part" : "region";
    byId("regions-text").textContent = `${counted(n, noun)}, neighbors in different colors`;
    byId("level").disabled = coloring.kind === "truth";
  }

  scaleStops() {
    const { scale } = this.content.arrays;
    const stops = [];
    for (let i = 0; i < 256; i += 15) stops.push(`rgb(${scale.subarray(3 * i, 3 * i + 3).join()})`);
    return stops.join();
  }

  /** What is known of a cell, as lines of text. */
  factsOf(cell) {
    const { labeling, content, coloring, facts } = this;
    const lines = [];
    if (labeling) {
      const region = content.labelsOf(labeling)[cell];
      if (region === NO_GROUP) {
        lines.push("no region");
      } else {
        const noun = labeling.name === "truth" ? "part" : "region";
        lines.push(`${noun} ${labeling.ids ? labeling.ids[region] : region}`);
        lines.push(counted(labeling.counts[region], facts.noun));
        lines.push(`${facts.measure} ${number(labeling.sizes[region])}`);
      }
    } else {
      lines.push(`${facts.noun} ${cell}`);
    }
    if (coloring.kind === "feature") {
      const value = content.valueOf(coloring, cell);
      lines.push(`${coloring.name} ${value === null ? "none" : number(value)}`);
    }
    return lines;
  }

  /** Show what is known of a cell beside the pointer, and mark its region. */
  tell(cell, x = 0, y = 0) {
    const tip = byId("tip");
    const lines = cell === null ? [] : this.factsOf(cell);
    const labels = cell === null || !this.labeling ? null : this.content.labelsOf(this.labeling);
    const marked = labels ? labels[cell] : NO_GROUP;
    if (marked !== this.drawing.marked) {
      this.drawing.marked = marked;
      this.drawing.request();
    }
    tip.hidden = cell === null;
    if (cell === null) return lines;
    tip.replaceChildren(...lines.map((line) => {
      const row = document.createElement("div");
      row.textContent = line;
      return row;
    }));
    const { right, bottom, left, top } = byId("canvas").getBoundingClientRect();
    tip.style.left = `${Math.min(left + x + 14, right - tip.offsetWidth - 4)}px`;
    tip.style.top = `${Math.min(top + y + 14, bottom - tip.offsetHeight - 4)}px`;
    return lines;
  }

  tellAt(x, y) {
    const lines = this.tell(this.drawing.cellAt(x, y), x, y);
    return lines.join(", ");
  }

  connectPointer() {
    const canvas = byId("canvas");
    const pressed = new Map();
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      pressed.set(event.pointerId, event);
      this.tell(null);
    });
    for (const name of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(name, (event) => pressed.delete(event.pointerId));
    }
    canvas.addEventListener("pointerleave", () => this.tell(null));
    canvas.addEventListener("pointermove", (event) => {
      if (!pressed.size) {
        this.hoverSoon(event);
      } else if (pressed.has(event.pointerId)) {
        this.drag(event, pressed);
        pressed.set(event.pointerId, event);
      }
    });
    const zoom = (event) => {
      event.preventDefault();
      const unit = event.deltaMode === 1 ? 30 : 1; // lines or pixels
      this.drawing.camera.zoomBy(Math.exp(-event.deltaY * unit * 0.0015));
      this.tell(null);
      this.drawing.move();
    };
    canvas.addEventListener("wheel", zoom, { passive: false });
    canvas.addEventListener("dblclick", () => this.reset());
  }

  hoverSoon(event) {
    const { left, top } = byId("canvas").getBoundingClientRect();
    this.pointer = [event.clientX - left, event.clientY - top];
    this.hovering ??= requestAnimationFrame(() => {
      this.hovering = null;
      this.tellAt(...this.pointer);
    });
  }

  drag(event, pressed) {
    const { camera } = this.drawing;
    const before = pressed.get(event.pointerId);
    const height = byId("canvas").clientHeight;
    const [x, y] = [(event.clientX - before.clientX) / height, (event.clientY - before.clientY) / height];
    if (pressed.size === 2) {
      const [other] = [...pressed.values()].filter((one) => one.pointerId !== event.pointerId);
      const apart = (one) => Math.hypot(one.clientX - other.clientX, one.clientY - other.clientY) || 1;
      camera.zoomBy(apart(event) / apart(before));
      camera.pan(x / 2, y / 2);
    } else if (event.buttons !== 1 || event.shiftKey || event.ctrlKey) {
      camera.pan(x, y);
    } else {
      camera.orbit(x * Math.PI, y * Math.PI);
    }
    this.drawing.move();
  }

  connectKeys() {
    const turn = Math.PI / 24;
    const move = (event, x, y) => {
      const { camera } = this.drawing;
      if (event.shiftKey) camera.pan(-x * 0.05, -y * 0.05);
      else camera.orbit(-x * turn, -y * turn);
    };
    const { camera } = this.drawing;
    const actions = {
      ArrowLeft: (event) => move(event, -1, 0),
      ArrowRight: (event) => move(event, 1, 0),
      ArrowUp: (event) => move(event, 0, -1),
      ArrowDown: (event) => move(event, 0, 1),
      "+": () => camera.zoomBy(1.2),
      "=": () => camera.zoomBy(1.2),
      "-": () => camera.zoomBy(1 / 1.2),
      0: () => camera.reset(),
      "[": () => this.setLevel(this.level - 1),
      "]": () => this.setLevel(this.level + 1),
      b: () => this.setBorders(!this.drawing.borders),
      c: () => this.nextColoring(),
      Enter: () => this.tellMiddle(),
    };
    byId("canvas").addEventListener("keydown", (event) => {
      const action = actions[event.key];
      if (!action || event.ctrlKey || event.altKey || event.metaKey) return;
      event.preventDefault();
      this.tell(null);
      action(event);
      this.drawing.move();
    });
  }

  nextColoring() {
    const { colorings } = this.content;
    this.setColoring((colorings.indexOf(this.coloring) + 1) % colorings.length);
  }

  /** For the keyboard and screen readers: what is in the middle of the page. */
  tellMiddle() {
    const { clientWidth, clientHeight } = byId("canvas");
    const text = this.tellAt(clientWidth / 2, clientHeight / 2);
    byId("status").textContent = text || `no ${this.facts.noun} in the middle`;
  }
}

async function open() {
  const facts = JSON.parse(byId("facts").textContent);
  const element = byId("payload");
  const bytes = await inflate(bytesOfBase64(element.textContent.trim()));
  element.remove(); // the text is as large as the mesh
  const arrays = decodeArrays(bytes, facts.arrays);
  return new Page(facts, arrays);
}

window.addEventListener("load", async () => {
  const canvas = byId("canvas");
  const fail = (message) => {
    byId("failure").textContent = `The mesh cannot be shown: ${message}.`;
    byId("failure").hidden = false;
  };
  canvas.addEventListener("webglcontextlost", () => fail("the graphics card was lost; load the page again"));
  try {
    window.superfacets = await open();
    document.documentElement.dataset.state = "ready";
  } catch (error) {
    fail(error.message);
    document.documentElement.dataset.state = "failed";
  }
});
