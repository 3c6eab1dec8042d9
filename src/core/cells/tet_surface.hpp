// Tetrahedra as cells: measures of arcs are given, vertices are known.
#pragma once

#include "cells/graph_surface.hpp"
#include "cells/tet_graph.hpp"

namespace superfacets {

// Arcs have reverse arcs, and corners are unknown.
class TetSurface final : public GraphSurface {
 public:
  TetSurface(std::span<const Point> vertices, std::span<const Tet> tets, const Arcs& arcs,
             const GivenMeasures& given)
      : GraphSurface(arcs, given), vertices_(vertices), tets_(tets) {
    SUPERFACETS_ASSERT(std::cmp_equal(tets.size(), arcs.n_cells()));
  }

  // The second moment of a tetrahedron about its centroid is 1/20 of the sum over its corners.
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
