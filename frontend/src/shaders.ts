// Two passes. The first draws what does not change while one paints: for each pixel the cell that is
// seen and how bright it is. The second looks up region, class and marks of that cell, and draws
// borders where neighboring pixels show different regions. Only a new view needs the first.

import { WIDTH } from "./textures";

const SHARED = `
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp usampler2D;
ivec2 place(uint i) { return ivec2(int(i & ${WIDTH - 1}u), int(i >> ${Math.log2(WIDTH)}u)); }
`;

export const CELLS_VERTEX = `${SHARED}
uniform mat4 modelViewMatrix;
uniform mat4 projectionMatrix;
uniform usampler2D vertices;  // bits of x, y, z; packed normal
uniform usampler2D sources;  // the cell of each triangle, where those are not the cells
uniform usampler2D cells;
uniform bool has_sources;
uniform bool has_hidden;
uniform bool is_cloud;
uniform float point_size;  // pixels at distance 1
in uint vertex;
flat out uint cell;
out vec3 at;
out vec3 normal;  // none in a crease
out float smoothness;  // 0 in a crease
vec3 unpacked(uint bits) {
  vec2 xy = vec2(bits & 65535u, bits >> 16) / 32767.0 - 1.0;
  vec3 v = vec3(xy, 1.0 - abs(xy.x) - abs(xy.y));
  if (v.z < 0.0) v.xy = (1.0 - abs(v.yx)) * vec2(v.x < 0.0 ? -1.0 : 1.0, v.y < 0.0 ? -1.0 : 1.0);
  return normalize(v);
}
void main() {
  uint piece = is_cloud ? vertex : uint(gl_VertexID) / 3u;
  cell = has_sources ? texelFetch(sources, place(piece), 0).r : piece;
  uvec4 texel = texelFetch(vertices, place(vertex), 0);
  at = (modelViewMatrix * vec4(uintBitsToFloat(texel.xyz), 1.0)).xyz;
  bool has_normal = texel.w != 0u;
  normal = has_normal ? mat3(modelViewMatrix) * unpacked(texel.w) : vec3(0.0);
  smoothness = has_normal ? 1.0 : 0.0;
  gl_Position = projectionMatrix * vec4(at, 1.0);
  gl_PointSize = max(1.0, point_size / -at.z);
  if (has_hidden && (texelFetch(cells, place(cell), 0).b & 4u) != 0u) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
}`;

export const CELLS_FRAGMENT = `${SHARED}
uniform bool is_cloud;
flat in uint cell;
in vec3 at;
in vec3 normal;
in float smoothness;
layout(location = 0) out vec4 id;  // cell + 1 in four bytes
layout(location = 1) out vec4 light;
void main() {
  uint number = cell + 1u;
  id = vec4(uvec4(number, number >> 8, number >> 16, number >> 24) & 255u) / 255.0;
  if (is_cloud) {
    vec2 off = gl_PointCoord - 0.5;
    if (dot(off, off) > 0.25) discard;
    if (smoothness == 0.0) {
      light = vec4(0.62, 0.0, 0.0, 1.0);
      return;
    }
  }
  vec3 toward = normalize(-at);
  vec3 flat_ = is_cloud ? normalize(normal) : normalize(cross(dFdx(at), dFdy(at)));
  flat_ = dot(flat_, toward) < 0.0 ? -flat_ : flat_;
  vec3 bent = dot(flat_, normal) < 0.0 ? -normal : normal;
  vec3 shading = normalize(bent + max(0.0, 1.0 - smoothness) * flat_);
  float key = max(0.0, dot(shading, normalize(vec3(-0.35, 0.6, 0.7))));
  float fill = max(0.0, dot(shading, normalize(vec3(0.8, 0.1, 0.4))));
  float head = max(0.0, dot(shading, toward));
  light = vec4((0.36 + 0.44 * key + 0.12 * fill + 0.16 * head) / 1.5, 0.0, 0.0, 1.0);
}`;

export const IMAGE_VERTEX = `${SHARED}
in vec3 position;
void main() { gl_Position = vec4(position.xy, 0.0, 1.0); }`;

export const IMAGE_FRAGMENT = `${SHARED}
uniform sampler2D ids;
uniform sampler2D lights;
uniform sampler2D depths;
uniform usampler2D regions;  // of each cell
uniform usampler2D cells;
uniform sampler2D region_colors;  // alpha: selected
uniform sampler2D class_colors;
uniform int stride;  // pixels of the first pass along one of this
uniform int samples;  // of those, how many are looked at
uniform int line;  // width of borders, in pixels of the first pass
uniform uint hovered;  // a region
uniform uint cursor;
uniform bool has_borders;
uniform bool is_cloud;
uniform vec2 near_far;
uniform vec3 high;  // of the background
uniform vec3 low;
uniform vec3 accent;
uniform float height;
out vec4 color;
const uint NONE = 0xffffffffu;

uint cellAt(ivec2 p) {
  uvec4 bytes = uvec4(round(texelFetch(ids, p, 0) * 255.0));
  return (bytes.x | bytes.y << 8 | bytes.z << 16 | bytes.w << 24) - 1u;  // NONE where nothing is
}
uint regionOf(uint cell) { return cell == NONE ? NONE - 1u : texelFetch(regions, place(cell), 0).r; }
float distanceAt(ivec2 p) {
  float z = 2.0 * texelFetch(depths, p, 0).r - 1.0;
  return 2.0 * near_far.x * near_far.y / (near_far.y + near_far.x - z * (near_far.y - near_far.x));
}
vec3 shade(ivec2 p, ivec2 limit) {
  uint cell = cellAt(p);
  if (cell == NONE) return mix(low, high, gl_FragCoord.y / height);
  uint region = regionOf(cell);
  uvec4 state = texelFetch(cells, place(cell), 0);
  bool is_active = false;
  vec3 base = vec3(0.62);
  if (region != NONE) {
    vec4 texel = texelFetch(region_colors, place(region), 0);
    base = texel.rgb;
    is_active = texel.a > 0.5 || region == hovered || region == cursor;
  }
  base = mix(vec3(0.88), base, 0.42);
  uint id = state.r | state.g << 8;
  if (id != 0u) {
    float shift = float((region * 2654435761u) >> 29) / 7.0 - 0.5;
    base = texelFetch(class_colors, place(id), 0).rgb * (1.0 + 0.12 * shift);
  }
  if ((state.b & 1u) != 0u) base = vec3(0.85, 0.07, 0.12);
  if ((state.b & 2u) != 0u) base = vec3(0.08, 0.25, 0.9);
  float light = 1.5 * texelFetch(lights, p, 0).r;
  if (is_cloud) {
    float here = log2(distanceAt(p));
    float shadow = 0.0;
    for (int k = 0; k < 4; k++) {
      ivec2 q = clamp(p + (2 * (k & 2) - 2) * (1 - (k & 1)) * ivec2(line, 0)
                        + (2 * (k & 2) - 2) * (k & 1) * ivec2(0, line), ivec2(0), limit);
      shadow += max(0.0, here - log2(distanceAt(q)));
    }
    light *= mix(0.45, 1.0, exp(-60.0 * shadow));
  }
  vec3 result = min(base * light, 1.0);
  bool is_marked = (state.b & 3u) != 0u;
  if (is_active && !is_marked) result = mix(result, vec3(1.0), region == hovered ? 0.3 : 0.16);
  if ((state.b & 8u) != 0u) result = mix(result, accent, 0.6);
  if (!has_borders && !is_active) return result;
  bool is_border = false;
  bool is_edge = false;
  int before = line / 2;
  int after = line - before;
  for (int k = 0; k < 4; k++) {
    int reach = (k & 1) == 0 ? after : before;
    if (is_active) reach = after + (line + 1) / 2;
    if (reach == 0) continue;
    ivec2 way = (k & 2) == 0 ? ivec2(reach, 0) : ivec2(0, reach);
    ivec2 q = clamp((k & 1) == 0 ? p + way : p - way, ivec2(0), limit);
    uint neighbor = cellAt(q);
    if (neighbor == cell) continue;
    uint other = regionOf(neighbor);
    if (other == region) continue;
    if (other < NONE - 1u || !is_cloud) is_edge = is_edge || is_active;
    if (other < NONE - 1u && region < NONE - 1u) is_border = true;
  }
  if (is_edge) return accent;
  if (is_border && has_borders) return mix(result, vec3(0.09, 0.09, 0.11), 0.82);
  return result;
}

void main() {
  ivec2 corner = ivec2(gl_FragCoord.xy) * stride;
  ivec2 limit = textureSize(ids, 0) - 1;
  vec3 sum = vec3(0.0);
  for (int y = 0; y < samples; y++) {
    for (int x = 0; x < samples; x++) sum += shade(min(corner + ivec2(x, y), limit), limit);
  }
  color = vec4(sum / float(samples * samples), 1.0);
}`;
