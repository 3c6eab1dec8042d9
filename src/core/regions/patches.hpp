// Stage 5: divides regions into patches. A patch is a group of adjacent regions that one thread
// processes.
#pragma once

#include "base/lists.hpp"
#include "cells/arcs.hpp"

namespace superfacets {

using Patch = std::int32_t;

// Patches with a graph coloring: adjacent patches have different colors.
struct Patches {
  std::vector<Patch> of_region;              // (K,) patch of each region
  std::vector<std::int32_t> colors;          // color of each patch
  std::vector<std::vector<Patch>> of_color;  // patches of each color, ascending

  Patch n_patches() const { return static_cast<Patch>(colors.size()); }
};

// Groups K regions into patches. A patch begins with a region adjacent to the previous patch, or
// with the lowest remaining label, and grows breadth first until it has enough border cells.
// Patches are colored greedily: each patch gets the color with the fewest cells so far among the
// colors of no adjacent patch. `border` contains the cells with a neighbor in another region,
// grouped by region. Time O(K + number of arcs of these cells).
Patches make_patches(const Arcs& arcs, std::span<const Label> labels, const Lists<Cell>& border);

}  // namespace superfacets
