#include "cells/components.hpp"

namespace superfacets {

Components find_components(const Arcs& arcs, std::span<const Label> labels, ThreadTeam& team) {
  SUPERFACETS_ASSERT(arcs.are_valid() && std::cmp_equal(labels.size(), arcs.n_cells()));
  const auto for_each_neighbor = [&](Cell cell, const auto& visit) {
    for (const Cell neighbor : arcs.neighbors(cell)) {
      if (labels[neighbor] == labels[cell]) visit(neighbor);
    }
  };
  return unite_neighbors(arcs.n_cells(), for_each_neighbor, team);
}

Components find_components(const OrderedGraph& graph, std::span<const Label> labels,
                           ThreadTeam& team) {
  SUPERFACETS_ASSERT(std::cmp_equal(labels.size(), graph.n_cells()));
  const auto for_each_neighbor = [&](Place place, const auto& visit) {
    for (const Arc arc : graph.arcs_of(place)) {
      if (labels[arc.to] == labels[place]) visit(arc.to);
    }
  };
  Components components = unite_neighbors(graph.n_cells(), for_each_neighbor, team);
  // So far, components are numbered in the order of the space-filling curve. The following loop
  // renumbers them in the order of their lowest cell indices.
  std::vector<Cell> ranks(components.n_components, kNoCell);
  Cell n_ranked = 0;
  for (const Place place : graph.in_input_order()) {
    Cell& rank = ranks[components.of[place]];
    if (rank == kNoCell) rank = n_ranked++;
  }
  for (Cell& component : components.of) component = ranks[component];
  return components;
}

}  // namespace superfacets
