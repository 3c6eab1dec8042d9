// Stage 5: patches: groups of adjacent regions, each processed by one thread.
#pragma once

#include "base/lists.hpp"
#include "cells/arcs.hpp"

namespace superfacets {

using Patch = std::int32_t;

// Patches, each with a color. No two patches of one color touch.
struct Patches {
  std::vector<Patch> of_region;              // (K,) patch of each region
  std::vector<std::int32_t> colors;          // color of each patch
  std::vector<std::vector<Patch>> of_color;  // patches of each color, ascending

  Patch n_patches() const { return static_cast<Patch>(colors.size()); }
};

// Groups regions into patches. A patch starts from the first region adjacent to the previous patch,
// or from the lowest remaining label, and grows breadth first until it has enough border cells.
// Patches are colored greedily in their order. A patch gets the color with the fewest cells so far
// among the colors that no adjacent patch has. `border` holds the cells with a neighbor in another
// region, grouped by region. Time O(K + n), for n arcs of these cells.
Patches make_patches(const Arcs& arcs, std::span<const Label> labels, const Lists<Cell>& border);

}  // namespace superfacets
