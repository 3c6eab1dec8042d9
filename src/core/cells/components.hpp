// Connected components, of a graph or of each region in it.
#pragma once

#include "base/buffer.hpp"
#include "base/types.hpp"
#include "cells/arcs.hpp"

namespace superfacets {

struct Components {
  Buffer<Cell> of_cell;  // (N,) component of each cell, 0..C-1, in the order of their lowest cells
  Cell n_components = 0;
};

// Two cells are in one component if a path between them stays in one label; with the same label
// everywhere these are the components of the graph. Labels may be any numbers. Arcs are taken to
// lead both ways. Time O(N + M).
Components find_components(const Arcs& arcs, std::span<const Label> labels);

}  // namespace superfacets
