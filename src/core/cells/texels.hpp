// Texels under the triangles of a textured mesh: their colors, and an image of region ids.
#pragma once

#include <cstdint>
#include <span>

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"

namespace superfacets {

// How coordinates outside of [0, 1] are taken.
enum class Wrap : std::uint8_t { kRepeat, kClamp, kMirror };

// The grid of texels of an image, and how it goes on beyond its sides.
struct TexelGrid {
  std::int64_t width;
  std::int64_t height;
  Wrap wrap_u;
  Wrap wrap_v;
};

// Texture coordinates of triangles: triangle t has those of corners 3 t to 3 t + 2. A coordinate is
// a pair u, v; v = 1 is the upper side of the image. A corner of -1 has none.
struct TexturedTriangles {
  std::span<const double> coordinates;    // (2 T,)
  std::span<const std::int32_t> corners;  // (3 N,)
};

struct TexelColors {
  Buffer<Point> means;     // (N,) red, green and blue in linear light, 0 to 1; NaN without texels
  Buffer<double> spreads;  // (N,) standard deviation of the color in linear light
};

// The mean color of the texels of an image whose centers a triangle covers. Triangles that cover
// none are sampled between texels, at up to 256 places. A triangle of more than 2^14 texels is
// sampled in every n-th row and column. `pixels` has three bytes per texel, rows from the upper
// side down; `linear` the light of each byte, 0 to 65535. Coordinates that are missing, not finite
// or more than 2^20 images away have no texels. The same bits on any number of threads.
TexelColors texel_colors(std::span<const std::uint8_t> pixels, const TexelGrid& grid,
                         std::span<const std::int32_t> linear, const TexturedTriangles& triangles,
                         ThreadTeam& team);

// The id of the triangle that covers each texel, rows from the upper side down; -1 where none does.
// The lowest triangle wins. A triangle that covers no center gets the texel in its middle, if that
// is free. Then ids grow by `bleed` texels into free ones. Triangles wider than four images are
// cut.
Buffer<std::int32_t> paint_ids(const TexelGrid& grid, const TexturedTriangles& triangles,
                               std::span<const std::int32_t> ids, int bleed, ThreadTeam& team);

}  // namespace superfacets
