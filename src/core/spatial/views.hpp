// Renders which triangle a pinhole camera sees in each pixel.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"

namespace superfacets {

// A pinhole camera. Pixel (i, j) is column i of row j; its center is at u = i + 0.5, v = j + 0.5.
struct View {
  double projection[12];  // (3, 4) matrix that maps (x, y, z, 1) to (u d, v d, d) for depth d
  double focal_product;   // product of the two focal lengths, in pixels
  std::int32_t width;     // number of columns
  std::int32_t height;    // number of rows

  std::int64_t n_pixels() const { return static_cast<std::int64_t>(width) * height; }
};

struct SeenSurface {
  // `triangles` and `areas` have one entry per pixel of each view, in row-major order.
  Buffer<Face> triangles;  // nearest triangle at the center of each pixel; -1 if there is none
  // surface area in each pixel; 0 if there is no triangle, or if the area is larger than
  // kMaxStretched times the area of a surface perpendicular to the ray
  Buffer<double> areas;
  // One entry per triangle: 1 if some view sees the triangle. A view sees a triangle if the
  // triangle has a pixel with a positive area, or if its centroid is in a pixel with a positive
  // area and is not hidden. A centroid is hidden if it is deeper than the surface in its pixel by
  // more than the length of this surface in the pixel.
  Buffer<std::uint8_t> is_seen;
};

// Maximum ratio between the surface area in a pixel and the area of a surface perpendicular to the
// ray. Surfaces within 6 degrees of the line of sight exceed this ratio. On these surfaces, an
// error of one pixel in a mask is an error of at least ten pixel widths on the surface.
inline constexpr double kMaxStretched = 10.0;

// Finds the visible triangles of each view. Triangles are visible from both sides. If several
// triangles have the same depth, the lowest is visible. Of a triangle that extends behind the
// camera, only the part in front can be visible. Takes about 20 ns per triangle and view, and 5 ns
// per pixel of each triangle in view. Results do not depend on the number of threads.
SeenSurface see_surface(std::span<const Point> vertices, std::span<const Triangle> triangles,
                        std::span<const View> views, ThreadTeam& team);

}  // namespace superfacets
