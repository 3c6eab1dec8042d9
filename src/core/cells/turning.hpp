// Orients the normals of points consistently.
#pragma once

#include "base/buffer.hpp"
#include "base/types.hpp"

namespace superfacets {

// The nearest neighbors of each point, in rows of equal length, padded with kNoPlace.
struct NeighborRows {
  std::span<const Place> places;  // (N * n_columns,) sorted index of each neighbor
  std::size_t n_columns;          // number of entries per row

  std::span<const Place> row(Place place) const {
    return places.subspan(n_columns * place, n_columns);
  }
};

// Flips normals so that neighbors agree. Neighbors are compared along a minimum spanning tree of
// each connected component, with the cost 1 - |n_i . n_j| (Hoppe et al. 1992). Pairs of normals
// that differ by less than ten degrees are joined first. Then flips all normals of a component if
// the component encloses a negative volume. Of pairs of equal cost, the pair with the lowest
// indices is joined first.
void turn_consistently(const NeighborRows& neighbors, std::span<const Point> positions,
                       std::span<const double> areas, std::span<Point> normals);

}  // namespace superfacets
