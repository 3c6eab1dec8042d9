#include "cells/components.hpp"

#include <vector>

#include "base/assert.hpp"

namespace superfacets {
Components find_components(const Arcs& arcs, std::span<const Label> labels) {
  SUPERFACETS_ASSERT(arcs.are_valid() && std::cmp_equal(labels.size(), arcs.n_cells()));
  return components_of(labels, [&](Cell cell, const auto& take) {
    for (const Cell neighbor : arcs.neighbors(cell)) take(neighbor);
  });
}

Components find_components(const OrderedGraph& graph, std::span<const Label> labels) {
  SUPERFACETS_ASSERT(std::cmp_equal(labels.size(), graph.n_cells()));
  Components components = components_of(labels, [&](Place place, const auto& take) {
    for (const Arc& arc : graph.arcs_of(place)) take(arc.to);
  });
  // Components must be numbered by their lowest cell. Up to here they are numbered by their lowest
  // place.
  std::vector<Cell> ranks(components.n_components, kNoCell);
  Cell n_ranked = 0;
  for (const Place place : graph.place_of) {
    Cell& rank = ranks[components.of[place]];
    if (rank == kNoCell) rank = n_ranked++;
  }
  for (Cell& component : components.of) component = ranks[component];
  return components;
}

}  // namespace superfacets
