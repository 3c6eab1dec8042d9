#include "regions/rings.hpp"

#include "base/assert.hpp"

namespace superfacets {

Buffer<std::uint8_t> cells_at_borders(std::span<const std::int64_t> offsets,
                                      std::span<const Cell> targets,
                                      std::span<const Label> labels) {
  SUPERFACETS_ASSERT(offsets.size() <= labels.size() + 1 && all_below(targets, labels.size()));
  Buffer<std::uint8_t> are_at_borders(offsets.size() - 1);
  const Arcs arcs{offsets, targets};
  for (Cell cell = 0; cell < arcs.n_cells(); ++cell) {
    are_at_borders[cell] = static_cast<std::uint8_t>(arcs.is_at_border(cell, labels));
  }
  return are_at_borders;
}

}  // namespace superfacets
