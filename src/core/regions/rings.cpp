#include "regions/rings.hpp"

#include <ranges>

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

std::vector<Cell> cells_around(const CornerLists& cells, std::span<const Vertex> representative,
                               std::span<const Cell> given) {
  SUPERFACETS_ASSERT(all_below(cells.corners, representative.size()));
  Buffer<std::uint8_t> rings(representative.size());
  std::ranges::fill(rings, std::uint8_t{0});
  for (const Cell cell : given) {
    for (const Vertex corner : cells[cell]) rings[representative[corner]] = 2;
  }
  const auto corners_of = [&](Cell cell) {
    return std::views::transform(cells[cell],
                                 [&](Vertex corner) { return representative[corner]; });
  };
  spread_rings(cells.n_cells(), corners_of, rings.span());
  std::vector<Cell> found;
  for (Cell cell = 0; cell < cells.n_cells(); ++cell) {
    const auto corners = corners_of(cell);
    if (std::ranges::any_of(corners, [&](Vertex corner) { return rings[corner] > 0; })) {
      found.push_back(cell);
    }
  }
  return found;
}

}  // namespace superfacets
