#include "pieces.hpp"

#include <algorithm>

namespace superfacets {
namespace {

constexpr Cell kNoPiece = -1;

}  // namespace

Pieces find_pieces(std::span<const std::int64_t> offsets, std::span<const Cell> neighbors,
                   std::span<const Label> labels) {
  Pieces pieces{Buffer<Cell>(labels.size()), 0};
  std::fill(pieces.of_cell.begin(), pieces.of_cell.end(), kNoPiece);
  std::vector<Cell>
      reached;  // cells of the current piece whose neighbors are still to be looked at
  for (std::size_t first = 0; first < labels.size(); ++first) {
    if (pieces.of_cell[first] != kNoPiece) continue;
    const Cell piece = pieces.n_pieces++;
    pieces.of_cell[first] = piece;
    reached.push_back(static_cast<Cell>(first));
    while (!reached.empty()) {
      const Cell cell = reached.back();
      reached.pop_back();
      for (std::int64_t arc = offsets[cell]; arc < offsets[cell + 1]; ++arc) {
        const Cell neighbor = neighbors[arc];
        if (labels[neighbor] != labels[first] || pieces.of_cell[neighbor] != kNoPiece) continue;
        pieces.of_cell[neighbor] = piece;
        reached.push_back(neighbor);
      }
    }
  }
  return pieces;
}

}  // namespace superfacets
