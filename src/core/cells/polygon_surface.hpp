// Polygon meshes as cells: the measures of arcs between faces that share an edge.
#pragma once

#include <unordered_map>

#include "cells/triangle_surface.hpp"
#include "mesh/polygons.hpp"

namespace superfacets {

// Surface of a polygon mesh and the arcs of its graph. Sides are numbered as in
// build_polygon_graph. For triangles, the results equal the results of TriangleSurface. Stores
// centroids, areas and normals (56 bytes per face), because computing them needs a loop around the
// polygon.
class PolygonSurface final : public Surface {
 public:
  // inside_out is true if normals point inwards; concave and convex are then swapped.
  PolygonSurface(std::span<const Point> vertices, const Polygons& faces, const Arcs& arcs,
                 std::span<const std::int32_t> sides, std::span<const std::uint8_t> same_turn,
                 bool inside_out, ThreadTeam& team);

  bool is_inside_out() const { return inside_out_; }

  Point position(Cell face) const override { return shapes_.centroids[face]; }
  double measure(Cell face) const override { return shapes_.areas[face]; }
  CellShape shape(Cell face) const override;
  double step_length(Cell from, std::int64_t arc) const override;
  double border_length(Cell from, std::int64_t arc) const override;
  double angle(Cell from, std::int64_t arc) const override;
  int side(Cell, std::int64_t arc) const override { return sides_[arc]; }
  double open_length(Cell face) const override;

  // Corners are vertices. If several vertices are at the same position, a corner may be any of
  // these vertices.
  bool has_corners() const override { return true; }
  int n_sides(Cell face) const override { return faces_.n_sides(face); }
  Corner corner_between(Cell face, int first_side, int second_side) const override;
  Cell next_around(Corner center, Cell before, Cell here) const override;

 private:
  Edge edge_of_side(Face face, int side) const;
  bool is_valid() const;
  std::pair<std::int64_t, std::int64_t> arcs_of_side(Face face, int side) const;
  int corner_at(Face face, Vertex vertex) const;
  int corner_of_large(Face face, Vertex vertex) const;
  void sort_large_faces();

  static constexpr std::size_t kMaxInARow = 32;  // up to this size, a linear search is faster

  // The corners of a face, sorted by vertex and sorted by position. Equal keys are sorted by
  // corner.
  struct SortedCorners {
    std::vector<int> by_vertex;
    std::vector<int> by_position;
  };

  const std::span<const Point> vertices_;
  const Polygons faces_;
  const std::span<const std::int32_t> sides_;  // (M,) side of the face that each arc crosses
  // (M,) 1 if both faces traverse the edge in the same direction.
  const std::span<const std::uint8_t> same_turn_;
  const bool inside_out_;
  const PolygonShapes shapes_;
  std::unordered_map<Face, SortedCorners>
      large_faces_;  // search index of each face with more than kMaxInARow corners
};

}  // namespace superfacets
