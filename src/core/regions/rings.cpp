#include "regions/rings.hpp"

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

}  // namespace superfacets
