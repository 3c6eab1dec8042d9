// Implementations of `Surface` that read the measures of arcs from arrays. They are used for graphs
// provided by the caller, and for tetrahedral meshes.
#pragma once

#include "cells/surface.hpp"

namespace superfacets {

// Measures of cells and arcs. If an optional array is empty, the default in its comment is used.
struct GivenMeasures {
  std::span<const Point> positions;        // (N,) position of each cell
  std::span<const double> measures;        // (N,) area or volume of each cell
  std::span<const double> border_lengths;  // (M,) length of the border that each arc crosses
  // (M,) step length of each arc; default: distance between its cells.
  std::span<const double> step_lengths;
  std::span<const double> angles;  // (M,) signed angle of each arc in radians; default: 0
  // (M,) side that each arc crosses; default: a different side per arc.
  std::span<const std::int32_t> sides;
  // (N,) length of each cell's border that no arc crosses; default: 0.
  std::span<const double> open_lengths;
};

// Surface of a graph. The surface has no corners, because a graph does not define the cells around
// a corner.
class GraphSurface : public Surface {
 public:
  GraphSurface(const Arcs& arcs, const GivenMeasures& given) : Surface(arcs), given_(given) {
    SUPERFACETS_ASSERT(is_valid());
  }

  Point position(Cell cell) const override { return given_.positions[cell]; }
  double measure(Cell cell) const override { return given_.measures[cell]; }
  double step_length(Cell from, std::int64_t arc) const override {
    return given_.step_lengths.empty() ? Surface::step_length(from, arc) : given_.step_lengths[arc];
  }
  double border_length(Cell, std::int64_t arc) const override { return given_.border_lengths[arc]; }
  double angle(Cell, std::int64_t arc) const override {
    return given_.angles.empty() ? 0.0 : given_.angles[arc];
  }
  int side(Cell from, std::int64_t arc) const override {
    return given_.sides.empty() ? Surface::side(from, arc) : given_.sides[arc];
  }
  bool may_have_one_way_arcs() const override { return true; }
  double open_length(Cell cell) const override {
    return given_.open_lengths.empty() ? 0.0 : given_.open_lengths[cell];
  }

 private:
  // Whether the sizes of the arrays agree, and arcs are sorted by side.
  bool is_valid() const {
    const auto n = static_cast<std::size_t>(n_cells());
    const std::size_t n_arcs = arcs().targets.size();
    const auto fits = [](const auto& array, std::size_t size) {
      return array.empty() || array.size() == size;
    };
    return arcs().are_valid() && given_.positions.size() == n && given_.measures.size() == n &&
           given_.border_lengths.size() == n_arcs && fits(given_.step_lengths, n_arcs) &&
           fits(given_.angles, n_arcs) && fits(given_.sides, n_arcs) &&
           fits(given_.open_lengths, n) && are_sides_sorted();
  }

  const GivenMeasures given_;
};

// Surface of tetrahedra. All arcs have reverse arcs. Corners are not defined.
class TetSurface final : public GraphSurface {
 public:
  TetSurface(std::span<const Point> vertices, std::span<const Tet> tets, const Arcs& arcs,
             const GivenMeasures& given)
      : GraphSurface(arcs, given), vertices_(vertices), tets_(tets) {
    SUPERFACETS_ASSERT(std::cmp_equal(tets.size(), arcs.n_cells()));
  }

  // The second moment of a tetrahedron about its centroid is 1/20 of the sum of p p^T over its
  // corners p, relative to the centroid.
  CellShape shape(Cell tet) const override {
    CellShape shape{position(tet), measure(tet), {}, {}, {}};
    for (const Vertex corner : tets_[tet].corners) {
      shape.spread.add(1.0 / 20.0, vertices_[corner] - shape.position);
      shape.box.include(vertices_[corner]);
    }
    return shape;
  }
  bool may_have_one_way_arcs() const override { return false; }

 private:
  const std::span<const Point> vertices_;
  const std::span<const Tet> tets_;
};

}  // namespace superfacets
