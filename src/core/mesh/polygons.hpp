// Stage 0: polygonal faces, with their centroids, areas and normals.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"

namespace superfacets {

// Faces with three or more corners each, stored one after the other. A face may have the same
// vertex at several corners.
struct Polygons {
  std::span<const std::int64_t>
      offsets;  // (F + 1,) the corners of face i have the indices offsets[i] .. offsets[i+1]-1
  std::span<const Vertex> corners;  // (C,) vertex of each corner

  std::int64_t n_faces() const { return static_cast<std::int64_t>(offsets.size()) - 1; }
  int n_sides(Face face) const { return static_cast<int>(offsets[face + 1] - offsets[face]); }
  std::span<const Vertex> operator[](Face face) const {
    return corners.subspan(offsets[face], offsets[face + 1] - offsets[face]);
  }

  // Whether the offsets begin with 0, increase by at least 3, and end with the number of corners.
  bool are_valid() const;
};

// Twice the sum of the area vectors of the fan of triangles (0, i, i + 1). For a planar polygon,
// convex or concave, the result is twice the area times the unit normal.
Point double_area_vector(std::span<const Point> vertices, std::span<const Vertex> corners);

// Unit normal of a polygon; zero if its area is not larger than rounding errors.
Point unit_normal(std::span<const Point> vertices, std::span<const Vertex> corners);

// Mean position of the corners.
Point mean_corner(std::span<const Point> vertices, std::span<const Vertex> corners);

// Centroid, area and unit normal of each face; the normal of a degenerate face is zero. The area is
// the area of the projection along the normal. The centroid is the area-weighted mean over the fan
// triangulation, in which flipped triangles have negative weight. The centroid is clamped to the
// bounding box of the corners, because the centroid of a self-intersecting polygon may be outside
// of the box. If there is no normal, the centroid is the mean of the corners. For triangles, the
// results have the same bits as the results of mesh/geometry.hpp.
struct PolygonShapes {
  Buffer<Point> centroids;
  Buffer<double> areas;
  Buffer<Point> normals;
};
PolygonShapes measure_polygons(std::span<const Point> vertices, const Polygons& faces,
                               ThreadTeam& team);

// Like sliver_area, for polygons. The length of a face is its longest side or diagonal from corner
// 0. The height of a face is the height of a triangle (if the face has three corners) or rectangle
// (otherwise) with this length and the area of the face. A sliver has a length of more than
// min_length, and a height of less than max_height.
double polygon_sliver_area(std::span<const Point> vertices, const Polygons& faces,
                           std::span<const double> areas, double min_length, double max_height,
                           ThreadTeam& team);

// Cuts each face of n corners into n - 2 triangles, stored consecutively. The triangles of face i
// begin at offsets[i] - 2 i. A face is cut into a fan of triangles around corner 0 if no triangle
// of the fan is flipped, as in convex faces, or if the face has more than kMaxCornersCut corners.
// Otherwise, ears are cut off one by one, usually in time O(n^2). If a self-intersecting polygon
// has no ear, corner 1 is cut off instead.
inline constexpr int kMaxCornersCut = 4096;
Buffer<Triangle> triangulate(std::span<const Point> vertices, const Polygons& faces,
                             ThreadTeam& team);

}  // namespace superfacets
