// Finds the triangle that a pinhole camera sees in each pixel.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"

namespace superfacets {

// A pinhole camera. Pixel (i, j) is column i of row j; its center is at u = i + 0.5, v = j + 0.5.
struct View {
  double projection[12];  // (3, 4): maps (x, y, z, 1) to (u d, v d, d) for depth d
  double focal_product;   // product of the two focal lengths, in pixels
  std::int32_t width;
  std::int32_t height;

  std::int64_t n_pixels() const { return static_cast<std::int64_t>(width) * height; }
};

struct SeenSurface {
  // One entry per pixel, row by row, view after view.
  Buffer<Face> triangles;  // the nearest triangle at the center of the pixel; -1 if there is none
  // surface area in the pixel; 0 if there is no triangle, or if the area is more than
  // kMostStretched times the area seen at a right angle
  Buffer<double> areas;
  // One entry per triangle: whether a view sees the triangle. A view sees it if it has a pixel with
  // an area, or if its centroid is not hidden. A centroid is hidden if it is deeper than the
  // surface in its pixel by more than the length of that surface in the pixel.
  Buffer<std::uint8_t> is_seen;
};

// Maximum ratio of surface area in a pixel to area seen at a right angle. Surfaces within 6 degrees
// of the line of sight exceed this ratio. On such surfaces, an error of one pixel in a mask is an
// error of ten pixel widths on the surface.
inline constexpr double kMostStretched = 10.0;

// Triangles are visible from both sides. Ties of depth go to the lowest triangle. Triangles that
// extend behind the camera are clipped. Time per view: about 20 ns per triangle, and 5 ns per pixel
// of each triangle in view. Results do not depend on the number of threads.
SeenSurface see_surface(std::span<const Point> vertices, std::span<const Triangle> triangles,
                        std::span<const View> views, ThreadTeam& team);

}  // namespace superfacets
