// Texels covered by the triangles of a textured mesh: mean colors, and images of region ids.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"

namespace superfacets {

// How texture coordinates outside [0, 1] are mapped into the image.
enum class Wrap : std::uint8_t { kRepeat, kClamp, kMirror };

// Size of an image, and how texture coordinates outside the image are mapped into it.
struct TexelGrid {
  std::int64_t width;
  std::int64_t height;
  Wrap wrap_u;
  Wrap wrap_v;
};

// Texture coordinates of triangles: the corners of triangle t are corners[3 t] to corners[3 t + 2],
// each the index of a pair (u, v), or -1 if the corner has no coordinates. v = 1 is the upper side
// of the image.
struct TexturedTriangles {
  std::span<const double> coordinates;    // (2 P,) pairs (u, v) of texture coordinates
  std::span<const std::int32_t> corners;  // (3 N,) index of a pair for each corner, or -1
};

struct TexelColors {
  Buffer<Point> means;     // (N,) mean red, green and blue in linear light, 0 to 1; NaN if unknown
  Buffer<double> spreads;  // (N,) standard deviation of the color in linear light; NaN if unknown
};

// Computes for each triangle the mean color of the texels whose centers the triangle covers. A
// triangle that covers no center is sampled between texels, at up to 256 positions. A triangle of
// more than 2^14 texels is sampled in every n-th row and column. `pixels` has three bytes per
// texel, in rows from top to bottom. `linear` maps each byte to linear light, 0 to 65535. The
// result is NaN for triangles with coordinates that are missing, not finite, or larger than 2^20 in
// magnitude. The result is the same for any number of threads.
TexelColors texel_colors(std::span<const std::uint8_t> pixels, const TexelGrid& grid,
                         std::span<const std::int32_t> linear, const TexturedTriangles& triangles,
                         ThreadTeam& team);

// For each texel, the id of the triangle that covers its center, or -1 if no triangle does. Rows of
// the result are from top to bottom. If several triangles cover a center, the triangle with the
// lowest index wins. A triangle that covers no center paints the texel at its centroid, if no
// triangle covers the center of that texel. Then ids are extended by `bleed` texels into uncovered
// texels. Triangles are clamped to four images per direction.
Buffer<std::int32_t> paint_ids(const TexelGrid& grid, const TexturedTriangles& triangles,
                               std::span<const std::int32_t> ids, int bleed, ThreadTeam& team);

}  // namespace superfacets
