// GLSL of the page. Each cell belongs to a color group, and each group has a color.

import { OWN_COLORS, TINTED } from "../shared/owncolors";
import { CODE, EYE, HEAD, LEFT_OUT, LIGHT, LINES } from "../shared/shaders";

export const SHADE = `${HEAD}${LIGHT}${EYE}${LEFT_OUT}${OWN_COLORS}${TINTED}
uniform float blend;  // opacity of the mesh's own colors or texture, 0 to 1
uniform usampler2D groups;  // color group of each cell, or NONE
uniform sampler2D colors;  // color of each group
uniform usampler2D regions;  // region of each cell, or NONE
uniform vec3 missing;  // color of cells without a group
uniform uint marked;  // region under the pointer, or NONE
out vec4 color;
void main() {
  uint group = texelFetch(groups, place(cell), 0).r;
  vec3 base = group == NONE ? missing : texelFetch(colors, place(group), 0).rgb;
  vec3 own = has_own_colors ? ownColor() : base;  // must be computed before any discard, because derivatives need neighboring pixels
  if (isLeftOut()) discard;
  if (blend > 0.0) base = group == NONE ? mix(base, own, blend) : tinted(base, own, blend);
  if (marked != NONE && texelFetch(regions, place(cell), 0).r == marked) base = mix(base, vec3(1.0), 0.45);
  color = vec4(min(base * light(vec3(0.4, 0.55, 0.75)), 1.0), 1.0);
}`;

export const CELLS = `${HEAD}${LIGHT}${EYE}${LEFT_OUT}${CODE}
out vec4 found;
void main() {
  if (isLeftOut()) discard;
  found = codeOf(cell);
}`;

// Draws each edge between two regions as a rectangle on the screen. Other edges become degenerate
// triangles, which are not drawn.
export const BORDER = `${HEAD}${EYE}${LINES.vertex}
uniform usampler2D edges;  // one texel per edge: two vertices and two adjacent cells
uniform usampler2D regions;
uniform vec2 frame;  // width and height of the canvas in pixels
uniform float line_width;  // width of borders in pixels
uniform bool hides_backs;
out vec3 at;
void main() {
  uvec4 edge = texelFetch(edges, place(uint(gl_VertexID / 6)), 0);
  int corner = gl_VertexID % 6;  // the rectangle consists of the triangles 0 1 2 and 2 1 3
  corner = corner < 3 ? corner : corner == 3 ? 2 : corner == 4 ? 1 : 3;
  uint left = texelFetch(regions, place(edge.z), 0).r;
  uint right = texelFetch(regions, place(edge.w), 0).r;
  gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
  at = vec3(0.0);
  if (left == right) return;
  uvec4 first = texelFetch(vertices, place(edge.x), 0);
  uvec4 second = texelFetch(vertices, place(edge.y), 0);
  vec3 a = seen(first);
  vec3 b = seen(second);
  if (hides_backs && max(dot(normalOf(first), a), dot(normalOf(second), b)) > 0.0) return;
  float pixel = 2.0 / (projection[1][1] * frame.y);  // size of a pixel at distance 1
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
  at = end < 0.0 ? a : b;
  vec2 shift = line_width * (0.35 * end * along + side * vec2(-along.y, along.x));
  gl_Position = place_ + vec4(shift / frame * place_.w, 0.0, 0.0);
}`;

export const INK = `${HEAD}${EYE}${LINES.fragment}
in vec3 at;
out vec4 color;
void main() {
  if (isOutside(at)) discard;
  color = vec4(0.11, 0.11, 0.12, 1.0);
}`;
