// Stage 5: patches: groups of adjacent regions, each processed by one thread.
#pragma once

#include "cells/arcs.hpp"

namespace superfacets {

// Cells grouped by an index, in CSR form.
struct GroupedCells {
  std::vector<std::int64_t> offsets;  // (number of groups + 1,)
  std::vector<Cell> cells;

  std::int32_t n_groups() const { return static_cast<std::int32_t>(offsets.size() - 1); }
  std::span<const Cell> of(std::int32_t group) const {
    return std::span(cells).subspan(offsets[group], offsets[group + 1] - offsets[group]);
  }
};

// Groups the cells of several lists. Each group keeps the order of its cells. group_of(cell) is
// called twice per cell. Time O(n + n_groups).
template <typename GroupOf>
GroupedCells group_cells(std::span<const std::vector<Cell>> lists, const GroupOf& group_of,
                         std::int32_t n_groups) {
  GroupedCells groups;
  // After the prefix sum, offsets[group + 1] is the write cursor of a group.
  groups.offsets.assign(std::size_t{2} + n_groups, 0);
  for (const std::vector<Cell>& list : lists) {
    for (const Cell cell : list) ++groups.offsets[group_of(cell) + 2];
  }
  for (std::int32_t group = 0; group < n_groups; ++group) {
    groups.offsets[group + 2] += groups.offsets[group + 1];
  }
  groups.cells.resize(groups.offsets.back());
  for (const std::vector<Cell>& list : lists) {
    for (const Cell cell : list) groups.cells[groups.offsets[group_of(cell) + 1]++] = cell;
  }
  groups.offsets.pop_back();
  return groups;
}

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
Patches make_patches(const Arcs& arcs, std::span<const Label> labels, const GroupedCells& border);

}  // namespace superfacets
