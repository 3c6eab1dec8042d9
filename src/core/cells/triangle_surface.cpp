#include "cells/triangle_surface.hpp"

#include "base/elementary.hpp"

namespace superfacets {
namespace {

// Relative tolerance for comparing areas. Rounding errors stay below this tolerance, so a mesh and
// its mirror image get the same result.
constexpr double kAreaNoise = 1e-9;

}  // namespace

double Fold::signed_angle(bool inside_out) const {
  const double theta = arctangent(sine, cosine);
  return is_concave(inside_out) ? theta : -theta;
}

bool turns_second(Face first, Face second, double first_area, double second_area) {
  const double difference = first_area - second_area;
  if (std::abs(difference) > kAreaNoise * std::max(first_area, second_area)) {
    return difference > 0.0;
  }
  return first < second;
}

double TriangleSurface::angle(Cell from, std::int64_t arc) const {
  const Face to = arcs().targets[arc];
  std::array normals{unit_normal(vertices_, faces_[from]), unit_normal(vertices_, faces_[to])};
  if (same_turn(arc)) {
    Point& turned = normals[turns_second(from, to, measure(from), measure(to)) ? 1 : 0];
    turned = -1.0 * turned;
  }
  return fold_of(normals[0], normals[1], position(to) - position(from)).signed_angle(inside_out_);
}

// The second moment of a triangle about its centroid is 1/12 of the sum of p p^T over its corners
// p, relative to the centroid.
CellShape TriangleSurface::shape(Cell face) const {
  const Point doubled = double_area_vector(vertices_, faces_[face]);
  CellShape shape{position(face), 0.5 * norm(doubled), 0.5 * doubled, {}, {}};
  for (const Vertex corner : faces_[face].corners) {
    shape.spread.add(1.0 / 12.0, vertices_[corner] - shape.position);
    shape.box.include(vertices_[corner]);
  }
  return shape;
}

// Whether the sizes of the arrays agree, and indices are in range.
bool TriangleSurface::is_valid() const {
  const std::size_t n_arcs = arcs().targets.size();
  const bool has_turns = same_turn_.empty() || same_turn_.size() == n_arcs;
  return arcs().are_valid() && std::cmp_equal(faces_.size(), n_cells()) && has_turns &&
         sides_.size() == n_arcs && all_below(sides_, 3) && are_sides_sorted();
}

double TriangleSurface::step_length(Cell from, std::int64_t arc) const {
  return length_over(edge(from, arc), position(from), position(arcs().targets[arc]));
}

double TriangleSurface::border_length(Cell from, std::int64_t arc) const {
  return edge(from, arc).length();
}

void TriangleSurface::write_crossed(Cell from, std::int64_t arc,
                                    std::span<CrossedBorder> crossed) const {
  const Point start = position(from);
  for (CrossedBorder& border : crossed) {
    const Edge side = edge(from, arc);
    border = {side.length(), length_over(side, start, position(arcs().targets[arc]))};
    ++arc;
  }
}

double TriangleSurface::open_length(Cell face) const {
  std::array<bool, 3> is_crossed{};
  for (const auto [arc, neighbor] : arcs().steps(face)) is_crossed[sides_[arc]] = true;
  double length = 0.0;
  for (int side = 0; side < 3; ++side) {
    if (!is_crossed[side]) length += edge_of_side(face, side).length();
  }
  return length;
}

Corner TriangleSurface::corner_between(Cell face, int first_side, int second_side) const {
  if (first_side == second_side) return kNoCorner;
  const int corner = (first_side + 1) % 3 == second_side ? second_side : first_side;
  return faces_[face].corners[corner];
}

Cell TriangleSurface::next_around(Corner center, Cell before, Cell here) const {
  const int corner = corner_at(vertices_, faces_[here].corners, static_cast<Vertex>(center));
  if (corner < 0) return kNoCell;
  const int opposite_side = (corner + 1) % 3;
  Cell next = kNoCell;
  for (const auto [arc, neighbor] : arcs().steps(here)) {
    if (int{sides_[arc]} == opposite_side || neighbor == before) continue;
    if (next != kNoCell) return kNoCell;
    next = neighbor;
  }
  return next;
}

bool TriangleSurface::leads_around(Corner corner, Cell before, Cell here, Cell goal,
                                   std::span<const Label> labels) const {
  return walk_around(*this, corner, before, here, goal, labels);
}

}  // namespace superfacets
