// The corners of all cells of a mesh, one cell after the other.
#pragma once

#include <iterator>

#include "base/types.hpp"

namespace superfacets {

struct CornerLists {
  std::span<const Vertex> corners;  // (C,) vertex of each corner
  std::span<const std::int64_t>
      offsets;  // (N + 1,) start of each cell in `corners`; empty if all cells have `size` corners
  std::int64_t size = 0;  // number of corners of every cell, if `offsets` is empty

  Cell n_cells() const {
    return static_cast<Cell>(offsets.empty() ? std::ssize(corners) / size
                                             : std::ssize(offsets) - 1);
  }
  std::int64_t begin_of(std::int64_t cell) const {
    return offsets.empty() ? size * cell : offsets[cell];
  }
  std::span<const Vertex> operator[](std::int64_t cell) const {
    return corners.subspan(begin_of(cell), begin_of(cell + 1) - begin_of(cell));
  }
};

}  // namespace superfacets
