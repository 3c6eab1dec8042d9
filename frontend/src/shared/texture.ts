// The texture of a mesh: an image, and texture coordinates of the corners of each triangle.

import type { Arrays } from "./arrays";
import { type Gpu, Picture, Table, type Values } from "./gl";
import type { Shape } from "./shape";

/**
 * An image of the texture atlas: left, top, width and height in pixels (width 0: no image), wrap modes
 * in x and y, and the red, green and blue factors of its color.
 */
type Tile = [number, number, number, number, number, number, number, number, number];

/** JSON description of a texture, written by superfacets_show.page.texture. */
export interface TextureFacts {
  low: [number, number];
  step: [number, number];
  tiles: Tile[];
}

/** Function `textureColor()`: texture color at a point of a triangle. A shader must include EYE before TEXTURE. */
export const TEXTURE = `
uniform bool has_texture;
uniform usampler2D texture_corners;  // one texel per triangle: three vertex indices and the tile index
uniform usampler2D texture_pairs;  // two texels per triangle: u and v of its three corners, as the bits of floats
uniform usampler2D texture_tiles;  // three texels per tile: rectangle, wrap modes, color factors
uniform sampler2D texture_image;
const float LEVELS = 5.0;  // highest mipmap level at which adjacent images of the atlas do not blend
int along(int i, int size, uint wrap) {
  if (wrap == 1u) return clamp(i, 0, size - 1);
  int period = wrap == 0u ? size : 2 * size;
  int rest = ((i % period) + period) % period;
  return rest < size ? rest : period - 1 - rest;
}
vec3 smoothed(uvec4 box, uvec4 wraps, vec2 uv, int level) {
  ivec2 size = max(ivec2(box.zw >> level), 1);
  vec2 texel = vec2(uv.x, 1.0 - uv.y) * vec2(size) - 0.5;
  ivec2 corner = ivec2(floor(texel));
  vec2 fraction = texel - floor(texel);
  vec3 rows[2];
  for (int y = 0; y < 2; y++) {
    vec3 pixels[2];
    for (int x = 0; x < 2; x++) {
      ivec2 inside = ivec2(along(corner.x + x, size.x, wraps.x), along(corner.y + y, size.y, wraps.y));
      pixels[x] = texelFetch(texture_image, ivec2(box.xy >> level) + inside, level).rgb;
    }
    rows[y] = mix(pixels[0], pixels[1], fraction.x);
  }
  return mix(rows[0], rows[1], fraction.y);
}
vec3 textureColor(uint piece, vec3 at) {
  vec3 right = dFdx(at);
  vec3 up = dFdy(at);
  uvec4 corners = texelFetch(texture_corners, place(piece), 0);
  uvec4 box = texelFetch(texture_tiles, place(3u * corners.w), 0);
  uvec4 wraps = texelFetch(texture_tiles, place(3u * corners.w + 1u), 0);
  vec3 tint = vec3(texelFetch(texture_tiles, place(3u * corners.w + 2u), 0).rgb) / 255.0;
  if (box.z == 0u) return tint;
  vec3 a = seen(texelFetch(vertices, place(corners.x), 0));
  vec3 b = seen(texelFetch(vertices, place(corners.y), 0)) - a;
  vec3 c = seen(texelFetch(vertices, place(corners.z), 0)) - a;
  vec3 across = cross(b, c);
  float scale = max(dot(across, across), 1e-30);
  // Maps a vector v in the plane of the triangle to the coefficients (s, t) in v = s * b + t * c.
  mat3x2 coefficients = transpose(mat2x3(cross(c, across), cross(across, b))) / scale;
  uvec4 first = texelFetch(texture_pairs, place(2u * piece), 0);
  uvec4 second = texelFetch(texture_pairs, place(2u * piece + 1u), 0);
  vec2 origin = uintBitsToFloat(first.xy);
  mat2 sides = mat2(uintBitsToFloat(first.zw) - origin, uintBitsToFloat(second.xy) - origin);
  vec2 uv = origin + sides * (coefficients * (at - a));
  vec2 size = vec2(box.zw);
  float texels_per_pixel = max(length(size * (sides * (coefficients * right))), length(size * (sides * (coefficients * up))));
  float level = clamp(log2(max(texels_per_pixel, 1.0)), 0.0, min(LEVELS, floor(log2(min(size.x, size.y)))));
  int whole = int(level);
  vec3 paint = smoothed(box, wraps, uv, whole);
  if (level > float(whole)) paint = mix(paint, smoothed(box, wraps, uv, whole + 1), level - float(whole));
  return tint * paint;
}
`;

export class TexturePaint {
  private readonly corners: Table;
  private readonly pairs: Table;
  private readonly tiles: Table;
  private readonly image: Picture;
  isShown = false;

  constructor(gpu: Gpu) {
    [this.corners, this.pairs, this.tiles] = Array.from({ length: 3 }, () => new Table(gpu));
    for (const table of [this.corners, this.pairs, this.tiles]) table.fill("rgba32", [0]);
    this.image = new Picture(gpu);
  }

  get bytes(): number {
    return this.corners.bytes + this.pairs.bytes + this.tiles.bytes + this.image.bytes;
  }

  /** Upload the texture of a triangle mesh. */
  show({ triangles }: Shape, facts: TextureFacts, arrays: Arrays, image: ImageBitmap): void {
    const [tileOf, steps] = [arrays.tile_of!, arrays.pairs!];
    const n = tileOf.length;
    const corners = new Uint32Array(4 * n);
    const pairs = new Float32Array(8 * n);
    for (let i = 0; i < n; i++) {
      corners.set(triangles!.subarray(3 * i, 3 * i + 3), 4 * i);
      corners[4 * i + 3] = tileOf[i];
      for (let k = 0; k < 6; k++) pairs[8 * i + k] = facts.low[k % 2] + facts.step[k % 2] * steps[6 * i + k];
    }
    const tiles = facts.tiles.flatMap((tile) => [...tile.slice(0, 4), tile[4], tile[5], 0, 0, ...tile.slice(6), 0]);
    this.corners.fill("rgba32", corners);
    this.pairs.fill("rgba32", new Uint32Array(pairs.buffer));
    this.tiles.fill("rgba32", tiles);
    this.image.fill(image);
    this.isShown = true;
  }

  /** Values of the uniforms that TEXTURE declares. */
  get values(): Values {
    const { corners, pairs, tiles, image, isShown } = this;
    return {
      has_texture: isShown, texture_corners: corners, texture_pairs: pairs, texture_tiles: tiles, texture_image: image,
    };
  }
}
