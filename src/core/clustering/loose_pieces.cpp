#include "clustering/loose_pieces.hpp"

#include "cells/components.hpp"

namespace superfacets {
namespace {

class PieceJoiner {
 public:
  PieceJoiner(const Arcs& arcs, std::span<const float> lengths, Buffer<Label> labels)
      : arcs_(arcs), lengths_(lengths), labels_(std::move(labels)), is_loose_(labels_.size()) {}

  void join(std::vector<Cell> loose, double crease_limit) {
    std::ranges::fill(is_loose_, 0);
    for (const Cell cell : loose) is_loose_[cell] = 1;
    while (!loose.empty() && (join_some(loose, crease_limit) || join_some(loose, HUGE_VAL))) {
    }
  }

  Buffer<Label> take_labels() && { return std::move(labels_); }

 private:
  // Runs one round that uses only arcs shorter than `crease_limit`. Returns whether any cell has
  // joined a region.
  bool join_some(std::vector<Cell>& loose, double crease_limit) {
    std::vector<std::pair<Cell, Label>> joining;
    for (const Cell cell : loose) {
      const Label label = nearest_label(cell, crease_limit);
      if (label != kNoLabel) joining.emplace_back(cell, label);
    }
    for (const auto& [cell, label] : joining) {
      labels_[cell] = label;
      is_loose_[cell] = 0;
    }
    std::erase_if(loose, [&](Cell cell) { return is_loose_[cell] == 0; });
    return !joining.empty();
  }

  Label nearest_label(Cell cell, double crease_limit) const {
    std::pair<float, Label> best{HUGE_VALF, kNoLabel};
    for (const auto [arc, neighbor] : arcs_.steps(cell)) {
      if (is_loose_[neighbor] != 0 || labels_[neighbor] == kNoLabel) continue;
      if (lengths_[arc] >= crease_limit) continue;
      best = std::min(best, {lengths_[arc], labels_[neighbor]});
    }
    return best.second;
  }

  const Arcs& arcs_;
  const std::span<const float> lengths_;
  Buffer<Label> labels_;
  Buffer<std::uint8_t> is_loose_;
};

// The cells that are not connected to the center of their region, ascending.
std::vector<Cell> loose_cells(const Components& pieces, std::span<const Label> labels,
                              std::span<const Cell> centers) {
  std::vector<Cell> loose;
  if (std::cmp_equal(pieces.n_components, centers.size())) return loose;
  for (Cell cell = 0; std::cmp_less(cell, labels.size()); ++cell) {
    if (labels[cell] == kNoLabel) continue;
    if (pieces.of[cell] != pieces.of[centers[labels[cell]]]) loose.push_back(cell);
  }
  return loose;
}

}  // namespace

Buffer<Label> join_loose_pieces(const Arcs& arcs, std::span<const float> lengths,
                                std::span<const Label> labels, std::span<const Cell> centers,
                                double crease_limit, ThreadTeam& team) {
  SUPERFACETS_ASSERT(std::cmp_equal(labels.size(), arcs.n_cells()));
  SUPERFACETS_ASSERT(std::ssize(lengths) == arcs.n_arcs());
  SUPERFACETS_ASSERT(all_below(centers, arcs.n_cells()));
  const std::vector<Cell> loose = loose_cells(find_components(arcs, labels, team), labels, centers);
  if (loose.empty()) return copy_of(labels);
  PieceJoiner joiner(arcs, lengths, copy_of(labels));
  joiner.join(loose, crease_limit);
  return std::move(joiner).take_labels();
}

}  // namespace superfacets
