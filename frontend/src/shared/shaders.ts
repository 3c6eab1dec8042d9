// GLSL code shared by the studio and the page: vertex positions, lighting, and cell numbers encoded as colors.

import { WIDTH } from "./gl";
import { NO_NORMAL } from "./normals";
import { NONE } from "./shape";

export const HEAD = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp usampler2D;
const uint NONE = ${NONE}u;
ivec2 place(uint i) { return ivec2(int(i % ${WIDTH}u), int(i / ${WIDTH}u)); }
`;

export const EYE = `
uniform usampler2D vertices;  // one texel per vertex: x, y, z and the encoded normal
uniform bool has_floats;  // whether x, y, z are the bits of floats, not integers; a coordinate is low + step_ * value
uniform vec3 low;
uniform vec3 step_;
uniform mat3 rotation;  // rotation from mesh to eye coordinates
uniform vec3 target;
uniform float distance_;
uniform mat4 projection;
vec3 seen(uvec4 texel) {
  vec3 steps = has_floats ? uintBitsToFloat(texel.xyz) : vec3(texel.xyz);
  return rotation * (low + step_ * steps - target) - vec3(0.0, 0.0, distance_);
}
`;

const NORMALS = `
vec3 unpacked(uint bits) {
  vec2 xy = vec2(bits & 255u, bits >> 8) / 127.0 - 1.0;
  vec3 v = vec3(xy, 1.0 - abs(xy.x) - abs(xy.y));
  if (v.z < 0.0) v.xy = (1.0 - abs(v.yx)) * vec2(v.x < 0.0 ? -1.0 : 1.0, v.y < 0.0 ? -1.0 : 1.0);
  return normalize(v);
}
// Normal in eye coordinates of a texel of the table of vertices; (0, 0, 0) for NO_NORMAL.
vec3 normalOf(uvec4 texel) { return texel.w == ${NO_NORMAL}u ? vec3(0.0) : rotation * unpacked(texel.w); }
`;

/** Vertex shader for triangles and for points. */
export const SURFACE = `${HEAD}${EYE}${NORMALS}
in uvec2 vertex;  // x: index of the vertex; y: triangle that has this vertex as first corner
uniform usampler2D sources;  // cell of each triangle, if has_sources; otherwise triangle i is cell i
uniform bool has_sources;
uniform bool is_cloud;
uniform float point_size;  // diameter of a point at distance 1, in pixels
uniform sampler2D own_colors;  // color of each vertex or point, if are_of_vertices
uniform bool are_of_vertices;
flat out uint cell;
flat out uint triangle;
out vec3 at;
out vec3 normal;  // normal in eye coordinates; (0, 0, 0) for NO_NORMAL
out float smoothness;  // 1 for a vertex with a normal, 0 for a vertex on a crease
out vec3 tint;
void main() {
  uint piece = is_cloud ? vertex.x : vertex.y;
  triangle = piece;
  cell = has_sources ? texelFetch(sources, place(piece), 0).r : piece;
  uvec4 texel = texelFetch(vertices, place(vertex.x), 0);
  at = seen(texel);
  normal = normalOf(texel);
  smoothness = texel.w == ${NO_NORMAL}u ? 0.0 : 1.0;
  tint = are_of_vertices ? texelFetch(own_colors, place(vertex.x), 0).rgb : vec3(0.0);
  gl_Position = projection * vec4(at, 1.0);
  gl_PointSize = max(1.0, point_size / -at.z);
}`;

/** Function `light()`: brightness of the current pixel, 0.42 to 1.06, for a lamp in this direction in eye coordinates. */
export const LIGHT = `
uniform bool is_cloud;
flat in uint cell;
in vec3 at;
in vec3 normal;
in float smoothness;
float light(vec3 lamp) {
  if (is_cloud && smoothness == 0.0) return 0.9;
  vec3 toward = normalize(-at);
  vec3 flat_ = is_cloud ? normalize(normal) : normalize(cross(dFdx(at), dFdy(at)));
  flat_ = dot(flat_, toward) < 0.0 ? -flat_ : flat_;
  vec3 bent = dot(flat_, normal) < 0.0 ? -normal : normal;
  vec3 shading = normalize(bent + max(0.0, 1.0 - smoothness) * flat_);
  float key = max(0.0, dot(shading, normalize(lamp)));
  return 0.42 + 0.48 * key + 0.16 * max(0.0, dot(shading, toward));
}
`;

/** Function `isOutside()`: whether a point of the mesh is outside the clip box. A shader must include EYE before it. */
const CLIP = `
uniform bool is_clipped;
uniform vec3 clip_low;
uniform vec3 clip_high;
bool isOutside(vec3 at) {
  vec3 here = transpose(rotation) * (at + vec3(0.0, 0.0, distance_)) + target;
  return is_clipped && (any(lessThan(here, clip_low)) || any(greaterThan(here, clip_high)));
}
`;

/** Function `isLeftOut()`: whether the pixel is outside the clip box, or seen from behind. LIGHT and EYE must precede it. */
export const LEFT_OUT = `${CLIP}
uniform bool hides_backs;
bool isLeftOut() {
  return isOutside(at) || (hides_backs && (is_cloud ? dot(normal, at) > 0.0 : !gl_FrontFacing));
}
`;

/** Vertex shader and fragment shader helpers of lines on the surface, which are left out together with the surface. */
export const LINES = { vertex: NORMALS, fragment: CLIP };

/** Function `codeOf()`: encodes a cell number as a color, which `cellsIn` decodes. */
export const CODE = `
vec4 codeOf(uint cell) {
  uint number = cell + 1u;
  return vec4(uvec4(number, number >> 8, number >> 16, number >> 24) & 255u) / 255.0;
}
`;
