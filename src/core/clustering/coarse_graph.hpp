// A smaller graph of larger cells, on which most iterations of the loop run.
#pragma once

#include <utility>
#include <vector>

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "cells/far_arcs.hpp"
#include "cells/ordered_graph.hpp"
#include "clustering/cell_grower.hpp"
#include "clustering/coarse_ranges.hpp"
#include "paths/expansion.hpp"

namespace superfacets {

// Path to each cell. The label is kNoLabel if there is no path.
struct SpreadPaths {
  Buffer<PathLength> lengths;
  Buffer<Label> labels;
};

// Groups the cells of a graph (fine cells) into connected coarse cells, each around a center. The
// measure of a coarse cell is the sum over its fine cells, and its position is their weighted mean.
// An arc between two coarse cells is as long as the shortest path from center to center that
// crosses their border once. Every component of the fine graph, however small, has at least one
// coarse cell.
//
// If steps of the fine graph are straight, coarse steps are straight too. The length of an arc is
// then the distance between the positions of its coarse cells, plus the lowest price of a path from
// center to center that crosses their border once. So the length of a shortest path hardly depends
// on its direction relative to the pattern of the fine cells. No coarse cell extends across an arc
// with a price of fine.barrier or more.
class CoarseGraph {
 public:
  // Makes coarse cells of about `cell_size` fine cells. The fine graph must be symmetric, and must
  // outlive this object. Memory: 2 bytes per fine cell beside the graph, 6 during construction.
  CoarseGraph(const OrderedGraph& fine, Place cell_size, ThreadTeam& team);

  const OrderedGraph& graph() const { return graph_; }
  const OrderedGraph& fine() const { return fine_; }

  // For each coarse cell, the measure-weighted mean of the rows of its fine cells.
  Buffer<float> means_of(const PartVectors& vectors, ThreadTeam& team) const;
  // Change the arcs of the coarse graph for the loop; see far_arcs.hpp and OrderedGraph.
  void add_far_arcs(ThreadTeam& team) { superfacets::add_far_arcs(graph_, kFarSteps, team); }
  void add_part_prices(const PartVectors& vectors, double factor, ThreadTeam& team) {
    graph_.add_part_prices(vectors, factor, team);
  }

  // Number of ranges of fine places. No coarse cell extends beyond a range.
  std::int64_t n_ranges() const { return std::ssize(first_cells_); }
  std::pair<Place, Place> places(std::int64_t range) const;
  // The coarse cells of a range, as the pair (first, one past the last).
  std::pair<Cell, Cell> cells_of(std::int64_t range) const {
    const bool is_last = range + 1 == n_ranges();
    return {first_cells_[range], is_last ? graph_.n_cells() : first_cells_[range + 1]};
  }
  Cell coarse_of(Place fine_place) const {
    return first_cells_[fine_place >> kRangeBits] + local_[fine_place];
  }

  // (N,) the coarse cell of each fine cell.
  Buffer<Cell> coarse_cells(ThreadTeam& team) const;

  // Extends paths from coarse cells to fine cells. `lengths` and `labels` describe the path to each
  // coarse cell. The path to a fine cell leads through the center of the coarse cell that makes the
  // path shortest. `centers` holds a fine cell of each region. The path to this cell is as long as
  // the offset of the region, or 0 without offsets. Without needs_lengths, the result has labels
  // only, and this object must not be used again: its arrays are freed.
  SpreadPaths spread(std::span<const PathLength> lengths, std::span<const Label> labels,
                     std::span<const Cell> centers, std::span<const PathLength> offsets,
                     bool needs_lengths, ThreadTeam& team);

  // The fine cell at the center of each coarse cell.
  std::vector<Cell> centers() const { return fine_.cells_at(centers_); }

  // For each region of coarse cells, the fine cell nearest to the mean of the region. Ties go to
  // the lowest cell. `labels` holds the label of each coarse cell, or kNoLabel if the cell is in no
  // region. `centers` holds a coarse cell of each region.
  std::vector<Cell> refine(std::span<const Label> labels, std::span<const Cell> centers,
                           ThreadTeam& team) const;

 private:
  // Each range of places is divided independently of the others, so the result is the same for any
  // number of threads.
  static constexpr int kRangeBits = CellGrower::kRangeBits;
  using LocalCell = std::uint16_t;  // index of a coarse cell within its range
  static_assert(kRangeBits <= 16);

  struct Part;
  std::vector<Part> divide(Place cell_size, Buffer<float>& lengths, ThreadTeam& team);
  void number(std::span<const Part> parts);
  Buffer<Point> positions(std::span<const Part> parts, ThreadTeam& team) const;
  void connect(std::int64_t range, const CrossingLengths& lengths, Part& part) const;
  OrderedGraph joined(std::span<const Part> parts, Buffer<Point> positions, ThreadTeam& team) const;

  const OrderedGraph& fine_;
  std::vector<Cell> first_cells_;  // first coarse cell of each range
  Buffer<LocalCell> local_;        // (N,) the coarse cell of each fine place
  std::vector<Place> centers_;     // (C,) fine place at the center of each coarse cell
  // the coarse graph; each place equals its cell, because coarse cells are numbered along the curve
  OrderedGraph graph_;
};

// The measure-weighted mean position of each region of coarse cells, summed in the order of cells.
// Cells with kNoLabel are in no region.
std::vector<Point> region_means(const OrderedGraph& coarse, std::span<const Label> labels,
                                std::int64_t n_regions);

}  // namespace superfacets
