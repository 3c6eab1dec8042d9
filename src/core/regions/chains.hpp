// Stage 5: moves chains of cells from one region to an adjacent region.
#pragma once

#include "base/prefetch.hpp"
#include "regions/borders.hpp"
#include "regions/patches.hpp"
#include "regions/stiffness.hpp"

namespace superfacets {

// The current labels of all cells, and cached data of cells near borders. The cache is
// uninitialized memory, and memory pages of cells far from borders are never touched.
class MovingRegions {
 public:
  MovingRegions(const Surface& surface, const BorderCosts& costs,
                std::span<const Label> first_labels, std::span<const Cell> fixed, ThreadTeam& team);

  const Surface& surface() const { return surface_; }
  const Arcs& arcs() const { return surface_.arcs(); }
  std::span<const Label> labels() const { return labels_.span(); }
  Buffer<Label> take_labels() && { return std::move(labels_); }

  Label label(Cell cell) const { return labels_[cell]; }
  bool is_at_border(Cell cell) const { return arcs().is_at_border(cell, labels()); }
  bool may_leave(Cell cell) const;

  // Costs of the borders that the arcs of a cell cross. The costs are computed at the first call
  // for a cell, because few arcs are near a border.
  std::span<const float> costs_of(Cell cell);

  // Decrease of the border cost if the cell moves from one region to the other.
  double gain_of(Cell cell, Label from, Label to);
  double cost_of_sides(Cell cell);

  // Distance that the border has moved at a cell: the path length from the cell to the initial
  // border of its current region, along cells that moved earlier.
  float travel(Cell cell) const {
    return labels_[cell] == first_labels_[cell] ? 0.0F : travels_[cell];
  }

  // The value of travel(cell) after a move to the adjacent region `to`.
  double travel_to(Cell cell, Label to) const;

  // prefetch_cell prefetches the data of a cell. When this data is in the cache, prefetch_arcs
  // prefetches the data of its arcs.
  void prefetch_cell(Cell cell) const {
    prefetch(&arcs().offsets[cell]);
    prefetch(&labels_[cell]);
    prefetch(&marks_[cell]);
  }
  void prefetch_arcs(Cell cell) const;

  void move(Cell cell, Label to, float travel) {
    labels_[cell] = to;
    travels_[cell] = travel;
  }

 private:
  static constexpr std::uint8_t kFixed = 1;
  static constexpr std::uint8_t kHasCosts = 2;

  const Surface& surface_;
  const BorderCosts border_costs_;
  const std::span<const Label> first_labels_;
  Buffer<Label> labels_;
  Buffer<std::uint8_t> marks_;  // (N,) combination of kFixed and kHasCosts
  // (N,) value of travel(cell); only set for cells outside their initial region.
  Buffer<float> travels_;
  Buffer<float> costs_;  // (M,) border costs of arcs; only set for the arcs of cells with kHasCosts
};

struct ChainOptions {
  // maximum distance by which a border moves (as a path length), in the unit of the positions
  double max_distance = 0.0;
  std::size_t max_chain = 1;  // maximum number of cells in a chain
};

// Tries chains of moves. Each thread uses a separate ChainMover.
class ChainMover {
 public:
  ChainMover(MovingRegions& regions, const Patches& patches, const Stiffness& stiffness,
             const ChainOptions& options)
      : regions_(regions),
        patches_(patches),
        stiffness_(stiffness),
        options_(options),
        changes_(stiffness.n_regions(), 0.0) {}

  // Tries a chain that begins with this cell for each adjacent region, and keeps the first chain
  // that lowers the cost. Returns the moved cells. The span is valid until the next call.
  std::span<const Cell> try_moves(Cell cell);

  // Returns the changes of region areas since the last call.
  std::vector<AreaChange> take_changes();

 private:
  // A candidate for the next move of a chain.
  struct Candidate {
    Cell cell = kNoCell;
    double gain = 0.0;    // decrease of the border cost
    StiffCell stiff;      // data for the decrease of the stiffness cost
    float travel = 0.0F;  // value of MovingRegions::travel_to; computed when the candidate is taken
  };

  bool move_chain(Cell first, Label to, double cost);
  std::size_t grow_chain(Cell first, Label from, Label to, double cost);
  Candidate candidate(Cell cell, Label from, Label to);
  Candidate take_candidate(Label from, Label to, StiffGain stiff, double least_gain);
  void add_candidates(Cell moved, Label from, Label to);
  StiffGain stiff_gain(Label from, Label to) const;
  void change_areas(Label from, Label to, double area);
  bool would_join_patches(Cell cell, Label from, Label to) const;

  MovingRegions& regions_;
  const Patches& patches_;
  const Stiffness& stiffness_;
  const ChainOptions options_;
  std::vector<double> changes_;  // (K,) area change of each region since the last take_changes()
  std::vector<Label> changed_;   // regions with area changes; may contain duplicates
  std::vector<Cell> chain_;      // cells in the order of their moves
  std::vector<float> travels_before_;  // travel() of each cell of the chain before its move
  std::vector<Candidate> candidates_;
};

}  // namespace superfacets
