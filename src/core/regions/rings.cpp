#include "regions/rings.hpp"

#include <algorithm>

#include "base/assert.hpp"

namespace superfacets {

Buffer<std::uint8_t> cells_at_borders(std::span<const std::int64_t> offsets,
                                      std::span<const Cell> targets,
                                      std::span<const Label> labels) {
  SUPERFACETS_ASSERT(offsets.size() <= labels.size() + 1 && all_below(targets, labels.size()));
  Buffer<std::uint8_t> are_at_borders(offsets.size() - 1);
  for (std::size_t cell = 0; cell + 1 < offsets.size(); ++cell) {
    bool differs = false;
    for (std::int64_t arc = offsets[cell]; arc < offsets[cell + 1]; ++arc) {
      differs |= labels[targets[arc]] != labels[cell];
    }
    are_at_borders[cell] = static_cast<std::uint8_t>(differs);
  }
  return are_at_borders;
}

void spread_rings(const CellCorners& cells, std::span<std::uint8_t> rings) {
  SUPERFACETS_ASSERT(all_below(cells.corners, rings.size()));
  // Round by round from the largest number down: a round writes smaller numbers, which the next one
  // reads.
  for (int ring = rings.empty() ? 0 : *std::max_element(rings.begin(), rings.end()); ring > 1;
       --ring) {
    const auto less = static_cast<std::uint8_t>(ring - 1);
    for (std::size_t cell = 0; cell + 1 < cells.offsets.size(); ++cell) {
      const std::span<const Vertex> corners = cells.of(cell);
      int largest = 0;
      for (const Vertex corner : corners) largest = std::max<int>(largest, rings[corner]);
      if (largest != ring) continue;  // if larger, it was handled in an earlier round
      for (const Vertex corner : corners) rings[corner] = std::max(rings[corner], less);
    }
  }
}

}  // namespace superfacets
