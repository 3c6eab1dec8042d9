// Texels under the triangles of a textured mesh: their colors, and an image of region ids.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"

namespace superfacets {

// How texture coordinates outside [0, 1] are mapped into the image.
enum class Wrap : std::uint8_t { kRepeat, kClamp, kMirror };

// The grid of texels of an image, and its continuation beyond its sides.
struct TexelGrid {
  std::int64_t width;
  std::int64_t height;
  Wrap wrap_u;
  Wrap wrap_v;
};

// Texture coordinates of triangles: the corners of triangle t are corners[3 t] to corners[3 t + 2],
// each the index of a pair (u, v), or -1 for no coordinates. v = 1 is the upper side of the image.
struct TexturedTriangles {
  std::span<const double> coordinates;    // (2 T,)
  std::span<const std::int32_t> corners;  // (3 N,)
};

struct TexelColors {
  Buffer<Point> means;     // (N,) red, green and blue in linear light, 0 to 1; NaN without texels
  Buffer<double> spreads;  // (N,) standard deviation of the color in linear light
};

// For each triangle, the mean color of the texels whose centers it covers. A triangle that covers
// no center is sampled between texels, at up to 256 places. A triangle of more than 2^14 texels is
// sampled in every n-th row and column. `pixels` has three bytes per texel, rows from the upper
// side down. `linear` maps each byte to linear light, 0 to 65535. Triangles with coordinates that
// are missing, not finite or more than 2^20 images away have no texels. The result is the same for
// any number of threads.
TexelColors texel_colors(std::span<const std::uint8_t> pixels, const TexelGrid& grid,
                         std::span<const std::int32_t> linear, const TexturedTriangles& triangles,
                         ThreadTeam& team);

// For each texel, the id of the triangle that covers its center, or -1 if no triangle does. Rows
// are from the upper side down. Ties go to the lowest triangle. A triangle that covers no center
// gets the texel in its middle, if that texel is free. Then ids spread by `bleed` texels into free
// texels. Triangles wider than four images are cut.
Buffer<std::int32_t> paint_ids(const TexelGrid& grid, const TexturedTriangles& triangles,
                               std::span<const std::int32_t> ids, int bleed, ThreadTeam& team);

}  // namespace superfacets
