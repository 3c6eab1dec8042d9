// Triangle meshes as cells: the measures of arcs between faces that share an edge.
#pragma once

#include "base/prefetch.hpp"
#include "cells/surface.hpp"
#include "mesh/geometry.hpp"

namespace superfacets {

struct Edge {
  Point start;
  Point end;

  Point middle() const { return 0.5 * (start + end); }
  double length() const { return norm(end - start); }
};

// Length of the path from centroid to centroid via the midpoint m of an edge: |c_i - m| + |m - c_j|
// (eq. 1).
inline double length_over(const Edge& edge, const Point& from, const Point& to) {
  const Point middle = edge.middle();
  return norm(from - middle) + norm(middle - to);
}

// The angle between two neighboring faces with unit normals n_i and n_j. Swapping the faces changes
// no bit of any member.
struct Fold {
  double sine;    // |n_i x n_j|; 0 if a normal is missing
  double cosine;  // n_i . n_j
  // height of each centroid above the plane of the other face, summed over both faces; if normals
  // point outwards, > 0 for concave edges
  double rise;

  bool is_concave(bool inside_out) const { return inside_out ? rise < 0.0 : rise > 0.0; }

  // The angle between the normals, -pi to pi, positive where the surface is concave.
  double signed_angle(bool inside_out) const;
};

// The fold between two faces, given their unit normals. `step` is the vector from the first
// centroid to the second.
inline Fold fold_of(const Point& normal_from, const Point& normal_to, const Point& step) {
  return {norm(cross(normal_from, normal_to)), dot(normal_from, normal_to),
          dot(normal_from - normal_to, step)};
}

// Decides which normal is flipped if two neighboring faces traverse their edge in the same
// direction. Returns true for the second face, and false for the first. The normal of the smaller
// face is flipped. If the areas are equal, the normal of the face with the higher index is flipped.
// An arc and its reverse arc flip the same normal.
bool turns_second(Face first, Face second, double first_area, double second_area);

// The first corner of a face at a vertex. If the face does not have this vertex, returns the first
// corner at the same position, or -1 if there is no such corner.
template <typename Corners>
int corner_at(std::span<const Point> vertices, const Corners& corners, Vertex vertex) {
  const auto n = static_cast<int>(std::size(corners));
  for (int corner = 0; corner < n; ++corner) {
    if (corners[corner] == vertex) return corner;
  }
  for (int corner = 0; corner < n; ++corner) {
    if (vertices[corners[corner]] == vertices[vertex]) return corner;
  }
  return -1;
}

// Surface of a triangle mesh and the arcs of its face graph. Sides are numbered as in
// build_triangle_graph. The object only refers to arrays of the caller.
class TriangleSurface final : public Surface {
 public:
  // same_turn is empty if all faces are consistently oriented. inside_out is true if normals point
  // inwards; concave and convex are then swapped.
  TriangleSurface(std::span<const Point> vertices, std::span<const Triangle> faces,
                  const Arcs& arcs, std::span<const std::uint8_t> sides,
                  std::span<const std::uint8_t> same_turn, bool inside_out)
      : Surface(arcs),
        vertices_(vertices),
        faces_(faces),
        sides_(sides),
        same_turn_(same_turn),
        inside_out_(inside_out) {
    SUPERFACETS_ASSERT(is_valid());
  }

  std::span<const Point> vertices() const { return vertices_; }
  std::span<const Triangle> faces() const { return faces_; }
  bool is_inside_out() const { return inside_out_; }

  // The edge that an arc crosses.
  Edge edge(Face from, std::int64_t arc) const { return edge_of_side(from, sides_[arc]); }

  // Whether both faces of an arc traverse their edge in the same direction.
  bool same_turn(std::int64_t arc) const { return !same_turn_.empty() && same_turn_[arc] != 0; }

  Point position(Cell face) const override { return centroid(vertices_, faces_[face]); }
  double measure(Cell face) const override { return area(vertices_, faces_[face]); }
  CellShape shape(Cell face) const override;
  double step_length(Cell from, std::int64_t arc) const override;
  double border_length(Cell from, std::int64_t arc) const override;
  void write_crossed(Cell from, std::int64_t arc, std::span<CrossedBorder> crossed) const override;
  double angle(Cell from, std::int64_t arc) const override;
  int side(Cell, std::int64_t arc) const override { return sides_[arc]; }
  double open_length(Cell face) const override;

  void prefetch_cell(Cell face, std::int64_t arc) const override {
    prefetch(&faces_[face]);
    prefetch(sides_.data() +
             // An address instead of an index, because `arc` is out of range if the last face has
             // no arc.
             arc);
  }

  // Corners are vertices. If several vertices are at the same position, a corner may be any of
  // these vertices.
  bool has_corners() const override { return true; }
  int n_sides(Cell) const override { return 3; }
  Corner corner_between(Cell face, int first_side, int second_side) const override;
  Cell next_around(Corner center, Cell before, Cell here) const override;
  bool leads_around(Corner corner, Cell before, Cell here, Cell goal,
                    std::span<const Label> labels) const override;

 private:
  Edge edge_of_side(Face face, int side) const {
    const auto& corners = faces_[face].corners;
    return {vertices_[corners[side]], vertices_[corners[next_corner(side)]]};
  }
  bool is_valid() const;

  const std::span<const Point> vertices_;
  const std::span<const Triangle> faces_;
  const std::span<const std::uint8_t> sides_;  // (M,) side of each arc, 0, 1 or 2
  // (M,) value of same_turn() for each arc; empty if all are false.
  const std::span<const std::uint8_t> same_turn_;
  const bool inside_out_;
};

}  // namespace superfacets
