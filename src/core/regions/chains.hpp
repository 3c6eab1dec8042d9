// Stage 5: chains of cells that move from one region to the next.
#pragma once

#include <vector>

#include "base/buffer.hpp"
#include "base/prefetch.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"
#include "cells/surface.hpp"
#include "regions/borders.hpp"
#include "regions/patches.hpp"
#include "regions/smooth.hpp"
#include "regions/stiffness.hpp"

namespace superfacets {

// The labels of all cells, which change, and data of the cells near borders, such as costs. Memory
// for such data of other cells is never touched.
class MovingRegions {
 public:
  MovingRegions(const Surface& surface, const BorderCost& cost, std::span<const Label> first_labels,
                std::span<const Cell> fixed, ThreadTeam& team);

  const Surface& surface() const { return surface_; }
  const Arcs& arcs() const { return surface_.arcs(); }
  std::span<const Label> labels() const { return labels_.span(); }
  Buffer<Label> take_labels() && { return std::move(labels_); }

  Label label(Cell cell) const { return labels_[cell]; }
  bool is_at_border(Cell cell) const { return arcs().is_at_border(cell, labels()); }
  bool may_leave(Cell cell);

  // Costs of the borders across the arcs of a cell, computed when first asked for, because few arcs
  // are near a border.
  std::span<const float> costs_of(Cell cell);

  // Whether a move of the cell was tried. A try reads the cells around it.
  bool was_examined(Cell cell) const { return (marks_[cell] & (kWasTried | kHasCosts)) != 0; }

  // The decrease of the cost of borders by a move of the cell.
  double gain_of(Cell cell, Label from, Label to);
  double cost_of_sides(Cell cell);

  // The distance of a cell from the first border of its region, on a path along cells that moved.
  float travel(Cell cell) const {
    return labels_[cell] == first_labels_[cell] ? 0.0F : travels_[cell];
  }

  // The travel of a cell after a move to an adjacent region.
  double travel_to(Cell cell, Label to) const;

  // Prefetch the data of a cell, in two steps: the cell itself, then the data of its arcs.
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
  static constexpr std::uint8_t kWasTried = 4;

  const Surface& surface_;
  const BorderCost border_cost_;
  const std::span<const Label> first_labels_;
  Buffer<Label> labels_;
  Buffer<std::uint8_t> marks_;  // kFixed, kHasCosts, kWasTried
  Buffer<float> travels_;       // travel_to, of cells not in their first region
  Buffer<float> costs_;         // of arcs of cells with kHasCosts
};

// Tries chains of moves; one for each thread.
class ChainMover {
 public:
  ChainMover(MovingRegions& regions, const Patches& patches, const Stiffness& stiffness,
             const SmoothOptions& options)
      : regions_(regions),
        patches_(patches),
        stiffness_(stiffness),
        options_(options),
        changes_(stiffness.n_regions(), 0.0) {}

  // Tries chains that begin with a cell, one for each neighboring region, and keeps the first that
  // makes borders cheaper. Returns the cells moved, until the next call.
  std::span<const Cell> try_moves(Cell cell);

  // Changes of areas by all moves since the last call.
  std::vector<AreaChange> take_changes();

 private:
  // A candidate for the next move of a chain.
  struct Candidate {
    Cell cell = kNoCell;
    double gain = 0.0;    // of borders
    StiffCell stiff;      // of the rest
    float travel = 0.0F;  // computed when it is examined
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
  const SmoothOptions options_;
  std::vector<double> changes_;        // of the area of each region, since take_changes
  std::vector<Label> changed_;         // regions with changes, with duplicates
  std::vector<Cell> chain_;            // moves in this order
  std::vector<float> travels_before_;  // of the cells of the chain
  std::vector<Candidate> candidates_;
};

}  // namespace superfacets
