// GLSL of the two passes in which the canvas is drawn. The first pass stores the cell number and the
// brightness of each pixel. The second pass looks up region, class and marks of each pixel's cell, and
// draws borders between pixels of different regions. Painting repeats only the second pass.

import { N_SHADES } from "../data/colors";
import { OWN_COLORS, TINTED } from "../../shared/owncolors";
import { CODE, EYE, HEAD, LEFT_OUT, LIGHT } from "../../shared/shaders";
import { MARK_BLUE, MARK_CURSOR, MARK_DIFFERS, MARK_HIDDEN, MARK_RED, N_MARK_BITS } from "./celltable";

// With "See inside", and in clouds, no border is drawn between neighboring pixels if their distances to the eye differ by more than this fraction.
const GAP = 0.01;

export const CELLS = `${HEAD}${LIGHT}${CODE}${EYE}${LEFT_OUT}${OWN_COLORS}
uniform usampler2D cells;
uniform bool has_hidden;
uniform bool has_focus;  // whether cells in front of the focused cells are left out
uniform usampler2D focused;  // 1 for each focused cell
uniform vec3 focus;  // middle of the focused cells
uniform float focus_radius;
layout(location = 0) out vec4 code;
layout(location = 1) out vec4 brightness;  // r: brightness; g, b, a: own color
void main() {
  vec3 own_color = has_own_colors ? ownColor() : vec3(0.0);  // must be computed before any discard, because derivatives need neighboring pixels
  if (has_hidden && (texelFetch(cells, place(cell), 0).b & ${MARK_HIDDEN}u) != 0u) discard;
  if (isLeftOut()) discard;
  if (has_focus && texelFetch(focused, place(cell), 0).r == 0u) {
    vec3 middle = rotation * (focus - target) - vec3(0.0, 0.0, distance_);
    float share = dot(at, middle) / dot(middle, middle);  // 0 at the eye, 1 at the depth of the focused cells
    if (share < 1.0 && length(at - share * middle) < share * focus_radius) discard;
  }
  vec2 off = gl_PointCoord - 0.5;
  if (is_cloud && dot(off, off) > 0.25) discard;
  code = codeOf(cell);
  brightness = vec4(light(vec3(0.45, 0.75, 0.5)) / 1.5, own_color);
}`;

/** Fragment shader that replaces the cell of each pixel by the cell as which a part of it is drawn. */
export const PARTS = `${HEAD}${CODE}
uniform sampler2D seen_cells;  // cells and depths that CELLS has drawn
uniform sampler2D depths;
uniform usampler2D shown;  // cell as which each part is drawn
flat in uint cell;
flat in uint triangle;
out vec4 code;
void main() {
  ivec2 p = ivec2(gl_FragCoord.xy);
  bool is_seen = all(lessThan(abs(texelFetch(seen_cells, p, 0) - codeOf(cell)), vec4(0.001)));
  // At its edges, a part covers pixels of other faces. Behind the silhouette of an object, parts are seen from behind.
  float behind = abs(gl_FragCoord.z - texelFetch(depths, p, 0).r);
  if (!is_seen && !(gl_FrontFacing && behind < fwidth(gl_FragCoord.z) + 1e-6)) discard;
  code = codeOf(texelFetch(shown, place(triangle), 0).r);
}`;

/** Vertex shader of the second pass: one triangle that covers the canvas. */
export const WHOLE = `${HEAD}
void main() {
  gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0);
}`;

/** Features of the second pass that change seldom. */
export interface Switches {
  is_cloud: boolean;
  has_borders: boolean;
  has_labels: boolean; // whether any cell has a class
  hides_backs: boolean;
  blends: boolean; // whether the mesh's own colors or texture are visible
  has_suggestions: boolean;
  blinks: boolean; // whether unlabeled cells are highlighted
}

/**
 * Fragment shader of the second pass. Switches are constants, so that compilers omit features that are off. Without a
 * graphics card, both sides of every other branch are computed, and these features would take more than half of the time.
 */
export const image = (switches: Switches): string => `${HEAD}${TINTED}
${Object.entries(switches).map(([name, isOn]) => `const bool ${name} = ${isOn};`).join("\n")}
uniform sampler2D ids;  // cell as which each pixel is drawn
uniform sampler2D lights;
uniform sampler2D depths;
uniform usampler2D regions;  // region of each cell, or NONE; regionOf gives NONE - 1 where no cell is drawn
uniform usampler2D cells;  // class, marks with shade, object: see CellTable
uniform sampler2D region_colors;  // color of each region; alpha is 1 if the region is selected
uniform sampler2D class_colors;  // ${N_SHADES} shades of each class, for its objects
uniform usampler2D suggestions;  // 1-based index of the suggestion of each cell; 0 if the cell has none
uniform sampler2D suggestion_colors;  // color of each suggestion; alpha is 1 for the chosen suggestion
uniform int stride;  // number of first-pass pixels per canvas pixel, in each direction
uniform int samples;  // number of first-pass pixels averaged per canvas pixel, in each direction
uniform int line;  // width of borders in first-pass pixels
uniform uint hovered;  // region under the pointer, or NONE
uniform uint cursor;  // region selected by keyboard, or NONE
uniform float blend;  // opacity of the mesh's own colors or texture, 0 to 1
uniform vec2 near_far;
uniform float focal;  // size of a segment of length 1 at distance 1, in first-pass pixels
uniform vec3 high;  // background color at the top
uniform vec3 low;  // background color at the bottom
uniform vec3 accent;  // color of highlights
uniform float height;  // height of the canvas in pixels
out vec4 color;

uint cellAt(ivec2 p) {
  uvec4 bytes = uvec4(round(texelFetch(ids, p, 0) * 255.0));
  return (bytes.x | bytes.y << 8 | bytes.z << 16 | bytes.w << 24) - 1u;  // the cell at p, or NONE where no cell is drawn
}
uint paintOf(uvec4 state) { return state.r | state.g << 8 | state.a << 16; }
uint suggestionOf(uint cell) { return has_suggestions && cell != NONE ? texelFetch(suggestions, place(cell), 0).r : 0u; }
uint regionOf(uint cell) { return cell == NONE ? NONE - 1u : texelFetch(regions, place(cell), 0).r; }
bool isBare(ivec2 p) {
  uint cell = cellAt(p);
  return cell != NONE && (texelFetch(cells, place(cell), 0).rg & 255u) == uvec2(0);
}
float distanceAt(ivec2 p) {
  float z = 2.0 * texelFetch(depths, p, 0).r - 1.0;
  return 2.0 * near_far.x * near_far.y / (near_far.y + near_far.x - z * (near_far.y - near_far.x));
}
// Approximate angle between the surfaces at both sides of a pixel: 0 on a plane, positive in valleys and behind the edge of
// an object, negative on ridges and at the edge. Inverse distances are linear on a plane.
float bendAt(ivec2 p, ivec2 way, ivec2 limit) {
  vec2 sides = vec2(distanceAt(max(p - way, ivec2(0))), distanceAt(min(p + way, limit)));
  vec2 slopes = focal / float(line) * (distanceAt(p) / sides - 1.0);
  float flatter = min(abs(slopes.x), abs(slopes.y));
  return (slopes.x + slopes.y) / (1.0 + flatter * flatter);
}
vec3 shade(ivec2 p, ivec2 limit) {
  uint cell = cellAt(p);
  for (int k = 0; blinks && k < 9; k++) {  // a single cell can be as small as a pixel, so pixels near it blink, too
    if (isBare(clamp(p + 3 * line * ivec2(k % 3 - 1, k / 3 - 1), ivec2(0), limit))) return vec3(1.0, 0.0, 0.75);
  }
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
  if (has_labels) base = vec3(dot(base, vec3(0.3, 0.6, 0.1)));  // gray, so that only classes have colors
  base = mix(vec3(0.88), base, has_labels ? 0.25 : 0.42);  // nearly one gray, so that the light shows the shapes
  uint id = state.r | state.g << 8;
  if (id != 0u) {
    float shift = float((region * 2654435761u) >> 29) / 7.0 - 0.5;
    base = texelFetch(class_colors, place(${N_SHADES}u * id + (state.b >> ${N_MARK_BITS})), 0).rgb * (1.0 + 0.12 * shift);
  }
  uint suggestion = id == 0u ? suggestionOf(cell) : 0u;
  vec4 tone = vec4(0.0);
  if (suggestion != 0u) {
    tone = texelFetch(suggestion_colors, place(suggestion), 0);
    base = mix(base, tone.rgb, (p.x + 65536 - p.y) / (4 * line) % 2 == 0 ? 0.9 : 0.3);
  }
  vec4 lit = texelFetch(lights, p, 0);
  if (blends) base = id != 0u || suggestion != 0u ? tinted(base, lit.gba, blend) : mix(base, lit.gba, blend);
  if ((state.b & ${MARK_RED}u) != 0u) base = vec3(0.85, 0.07, 0.12);
  if ((state.b & ${MARK_BLUE}u) != 0u) base = vec3(0.08, 0.25, 0.9);
  float light = 1.5 * lit.r;
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
  if (has_labels && id == 0u && !is_cloud) {  // without colors, edges of objects would hardly be visible
    float bend = bendAt(p, ivec2(line, 0), limit) + bendAt(p, ivec2(0, line), limit);
    light *= 1.0 - clamp(0.3 * bend, -0.2, 0.5);
  }
  vec3 result = min(base * light, 1.0);
  bool is_marked = (state.b & ${MARK_RED | MARK_BLUE}u) != 0u;
  if (is_active && !is_marked) result = mix(result, vec3(1.0), region == hovered ? 0.3 : 0.16);
  if ((state.b & ${MARK_DIFFERS}u) != 0u && (p.x + p.y) / (3 * line) % 2 == 0) result = mix(result, accent, 0.75);
  if ((state.b & ${MARK_CURSOR}u) != 0u) result = mix(result, accent, 0.6);
  if (!has_borders && !is_active && state.a == 0u && suggestion == 0u) return result;
  bool is_outline = false;  // whether the pixel is at the border of a suggestion
  bool is_border = false;  // whether the pixel is at the border between two regions
  bool is_edge = false;  // whether the pixel is at the border of a highlighted region
  bool is_object = false;  // whether the pixel is at the border between two objects of a class
  int before = line / 2;
  int after = line - before;
  for (int k = 0; k < 4; k += before > 0 || is_active || tone.a > 0.5 ? 1 : 2) {  // thin lines have no pixels at odd k
    int reach = (k & 1) == 0 ? after : before;
    if (is_active || tone.a > 0.5) reach = after + (line + 1) / 2;
    if (reach == 0) continue;
    ivec2 way = (k & 2) == 0 ? ivec2(reach, 0) : ivec2(0, reach);
    ivec2 q = clamp((k & 1) == 0 ? p + way : p - way, ivec2(0), limit);
    uint neighbor = cellAt(q);
    if (neighbor == cell) continue;
    if (neighbor != NONE && state.a != 0u) {
      uint paint = paintOf(texelFetch(cells, place(neighbor), 0));
      is_object = is_object || (paint != paintOf(state) && paint != 0u && (paint & 0xffffu) == id);
    }
    is_outline = is_outline || (suggestion != 0u && suggestionOf(neighbor) != suggestion);
    uint other = regionOf(neighbor);
    if (other == region) continue;
    if (other < NONE - 1u || !is_cloud) is_edge = is_edge || is_active;
    // Hidden noisy walls, and points seen through gaps, are specks, which would be black dots if they had outlines.
    bool is_gap = (hides_backs || is_cloud) && abs(distanceAt(q) / distanceAt(p) - 1.0) > ${GAP};
    if (other < NONE - 1u && region < NONE - 1u && !is_gap) is_border = true;
  }
  if (is_edge) return accent;
  if (is_outline) return tone.a > 0.5 ? accent : 0.55 * tone.rgb;
  if (is_object) return vec3(0.02);
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
