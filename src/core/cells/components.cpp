#include "cells/components.hpp"

#include <vector>

namespace superfacets {
namespace {

constexpr Cell kNoComponent = -1;

}  // namespace

Components find_components(const Arcs& arcs, std::span<const Label> labels) {
  return components_of(labels, [&](Cell cell, const auto& take) {
    for (const Cell neighbor : arcs.neighbors(cell)) take(neighbor);
  });
}

Components find_components(const OrderedGraph& graph, std::span<const Label> labels) {
  Components components = components_of(labels, [&](Place place, const auto& take) {
    for (const Arc& arc : graph.arcs_of(place)) take(arc.to);
  });
  std::vector<Cell> ranks(components.n_components, kNoComponent);  // by lowest cell, not place
  Cell n_ranked = 0;
  for (const Place place : graph.place_of) {
    Cell& rank = ranks[components.of[place]];
    if (rank == kNoComponent) rank = n_ranked++;
  }
  for (Cell& component : components.of) component = ranks[component];
  return components;
}

}  // namespace superfacets
