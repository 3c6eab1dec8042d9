#include "cells/polygon_surface.hpp"

#include <numeric>

namespace superfacets {

PolygonSurface::PolygonSurface(std::span<const Point> vertices, const Polygons& faces,
                               const Arcs& arcs, std::span<const std::int32_t> sides,
                               std::span<const std::uint8_t> same_turn, bool inside_out,
                               ThreadTeam& team)
    : Surface(arcs),
      vertices_(vertices),
      faces_(faces),
      sides_(sides),
      same_turn_(same_turn),
      inside_out_(inside_out),
      shapes_(measure_polygons(vertices, faces, team)) {
  SUPERFACETS_ASSERT(is_valid());
  sort_large_faces();
}

// The second moment of a polygon is summed over the same fan of triangles (0, i, i + 1) as its area
// and centroid. Flipped triangles have negative weight. Per unit area, the second moment of a
// triangle with corners a, b and c is (a a^T + b b^T + c c^T + s s^T) / 12, where s = a + b + c. A
// face without a normal is treated as a point at its centroid.
CellShape PolygonSurface::shape(Cell face) const {
  const Point& center = shapes_.centroids[face];
  CellShape shape{center, shapes_.areas[face], shapes_.areas[face] * shapes_.normals[face], {}, {}};
  const auto corners = faces_[face];
  for (const Vertex corner : corners) shape.box.include(vertices_[corner]);
  if (squared_norm(shapes_.normals[face]) == 0.0) return shape;
  const Point first = vertices_[corners[0]] - center;
  for (std::size_t i = 2; i < corners.size(); ++i) {
    const Point second = vertices_[corners[i - 1]] - center;
    const Point third = vertices_[corners[i]] - center;
    const double area = 0.5 * dot(cross(second - first, third - first), shapes_.normals[face]);
    for (const Point& p : {first, second, third, first + second + third}) {
      shape.spread.add(area / shapes_.areas[face] / 12.0, p);
    }
  }
  return shape;
}

// Whether the sizes of the arrays agree, and indices are in range.
bool PolygonSurface::is_valid() const {
  const std::size_t n_arcs = arcs().targets.size();
  if (!arcs().are_valid() || !faces_.are_valid() || faces_.n_faces() != n_cells()) return false;
  const bool has_turns = same_turn_.empty() || same_turn_.size() == n_arcs;
  if (!has_turns || sides_.size() != n_arcs) return false;
  for (Face face = 0; face < n_cells(); ++face) {
    for (const auto [arc, neighbor] : arcs().steps(face)) {
      if (sides_[arc] < 0 || sides_[arc] >= faces_.n_sides(face)) return false;
    }
  }
  return are_sides_sorted();
}

Edge PolygonSurface::edge_of_side(Face face, int side) const {
  const auto corners = faces_[face];
  const std::size_t next = static_cast<std::size_t>(side) + 1;
  return {vertices_[corners[side]], vertices_[corners[next == corners.size() ? 0 : next]]};
}

double PolygonSurface::step_length(Cell from, std::int64_t arc) const {
  const Cell to = arcs().targets[arc];
  return length_over(edge_of_side(from, sides_[arc]), shapes_.centroids[from],
                     shapes_.centroids[to]);
}

double PolygonSurface::border_length(Cell from, std::int64_t arc) const {
  return edge_of_side(from, sides_[arc]).length();
}

double PolygonSurface::angle(Cell from, std::int64_t arc) const {
  const Face to = arcs().targets[arc];
  std::array normals{shapes_.normals[from], shapes_.normals[to]};
  if (!same_turn_.empty() && same_turn_[arc] != 0) {
    Point& turned = normals[turns_second(from, to, measure(from), measure(to)) ? 1 : 0];
    turned = -1.0 * turned;
  }
  return fold_of(normals[0], normals[1], position(to) - position(from)).signed_angle(inside_out_);
}

double PolygonSurface::open_length(Cell face) const {
  std::vector<bool> is_crossed(faces_.n_sides(face));
  for (const auto [arc, neighbor] : arcs().steps(face)) is_crossed[sides_[arc]] = true;
  double length = 0.0;
  for (int side = 0; side < faces_.n_sides(face); ++side) {
    if (!is_crossed[side]) length += edge_of_side(face, side).length();
  }
  return length;
}

Corner PolygonSurface::corner_between(Cell face, int first_side, int second_side) const {
  const int n = faces_.n_sides(face);
  if ((first_side + 1) % n == second_side) return faces_[face][second_side];
  if ((second_side + 1) % n == first_side) return faces_[face][first_side];
  return kNoCorner;
}

Cell PolygonSurface::next_around(Corner center, Cell before, Cell here) const {
  const int corner = corner_at(here, static_cast<Vertex>(center));
  if (corner < 0) return kNoCell;
  const int side_before = corner == 0 ? faces_.n_sides(here) - 1 : corner - 1;
  Cell next = kNoCell;
  for (const int side : {corner, side_before}) {
    const auto [first, last] = arcs_of_side(here, side);
    for (std::int64_t arc = first; arc < last; ++arc) {
      const Cell neighbor = arcs().targets[arc];
      if (neighbor == before) continue;
      if (next != kNoCell) return kNoCell;
      next = neighbor;
    }
  }
  return next;
}

// Range [first, last) of the arcs that cross a side of a face.
std::pair<std::int64_t, std::int64_t> PolygonSurface::arcs_of_side(Face face, int side) const {
  const std::int64_t begin = arcs().offsets[face];
  const std::int64_t end = arcs().offsets[face + 1];
  const auto sides = sides_.subspan(begin, end - begin);
  const auto [first, last] = std::equal_range(sides.begin(), sides.end(), side);
  return {begin + (first - sides.begin()), begin + (last - sides.begin())};
}

int PolygonSurface::corner_at(Face face, Vertex vertex) const {
  const auto corners = faces_[face];
  if (corners.size() > kMaxInARow) return corner_of_large(face, vertex);
  return superfacets::corner_at(vertices_, corners, vertex);
}

void PolygonSurface::sort_large_faces() {
  for (Face face = 0; face < n_cells(); ++face) {
    const auto corners = faces_[face];
    if (corners.size() <= kMaxInARow) continue;
    std::vector<int> sorted(corners.size());
    std::iota(sorted.begin(), sorted.end(), 0);
    SortedCorners& large = large_faces_[face];
    std::ranges::stable_sort(sorted, [&](int a, int b) { return corners[a] < corners[b]; });
    large.by_vertex = sorted;
    std::iota(sorted.begin(), sorted.end(), 0);
    std::ranges::stable_sort(
        sorted, [&](int a, int b) { return vertices_[corners[a]] < vertices_[corners[b]]; });
    large.by_position = std::move(sorted);
  }
}

int PolygonSurface::corner_of_large(Face face, Vertex vertex) const {
  const auto corners = faces_[face];
  const SortedCorners& large = large_faces_.at(face);
  const auto named =
      std::lower_bound(large.by_vertex.begin(), large.by_vertex.end(), vertex,
                       [&](int corner, Vertex wanted) { return corners[corner] < wanted; });
  if (named != large.by_vertex.end() && corners[*named] == vertex) return *named;
  const auto there =
      std::lower_bound(large.by_position.begin(), large.by_position.end(), vertices_[vertex],
                       [&](int corner, const Point& p) { return vertices_[corners[corner]] < p; });
  const bool is_there =
      there != large.by_position.end() && vertices_[corners[*there]] == vertices_[vertex];
  return is_there ? *there : -1;
}

}  // namespace superfacets
