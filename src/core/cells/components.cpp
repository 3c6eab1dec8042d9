#include "cells/components.hpp"

#include <algorithm>

namespace superfacets {
namespace {

constexpr Cell kNoComponent = -1;

}  // namespace

Components find_components(const Arcs& arcs, std::span<const Label> labels) {
  Components components{Buffer<Cell>(labels.size()), 0};
  std::fill(components.of_cell.begin(), components.of_cell.end(), kNoComponent);
  std::vector<Cell> reached;  // cells of this component whose neighbors are still to be visited
  for (Cell first = 0; first < arcs.n_cells(); ++first) {
    if (components.of_cell[first] != kNoComponent) continue;
    const Cell component = components.n_components++;
    components.of_cell[first] = component;
    reached.push_back(first);
    while (!reached.empty()) {
      const Cell cell = reached.back();
      reached.pop_back();
      for (const Cell neighbor : arcs.neighbors(cell)) {
        const bool is_same = labels[neighbor] == labels[first];
        if (!is_same || components.of_cell[neighbor] != kNoComponent) continue;
        components.of_cell[neighbor] = component;
        reached.push_back(neighbor);
      }
    }
  }
  return components;
}

}  // namespace superfacets
