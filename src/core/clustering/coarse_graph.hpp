// A graph of coarse cells, on which most iterations of the loop run.
#pragma once

#include "cells/far_arcs.hpp"
#include "clustering/coarse_ranges.hpp"
#include "paths/expansion.hpp"

namespace superfacets {

// Result of CoarseGraph::spread. The label of a cell is kNoLabel if there is no path to the cell.
struct SpreadPaths {
  Buffer<PathLength> lengths;  // (N,) length of the path to each cell
  Buffer<Label> labels;        // (N,) label of the path to each cell
};

// Groups the cells of a graph (fine cells) into connected coarse cells, each around a center. The
// measure of a coarse cell is the sum over its fine cells, and its position is their weighted mean.
// An arc between two coarse cells has the length of the shortest path from center to center that
// crosses their border once. Every connected component of the fine graph has at least one coarse
// cell.
//
// If the fine graph has a straight_unit > 0 (see OrderedGraph), the coarse graph has the same
// straight_unit. The length of a coarse arc is then the straight distance between the positions of
// its cells, plus the lowest crease cost of a path from center to center that crosses their border
// once. So the length of a shortest path hardly depends on its direction relative to the pattern of
// the fine cells. No coarse cell extends across an arc whose crease cost is at least
// fine.crease_limit.
class CoarseGraph {
 public:
  // Builds coarse cells of about `cell_size` fine cells each. The fine graph must be symmetric, and
  // must outlive this object. Uses 2 bytes per fine cell in addition to the coarse graph, and 6
  // during construction.
  CoarseGraph(const OrderedGraph& fine, Place cell_size, ThreadTeam& team);

  const OrderedGraph& graph() const { return graph_; }
  const OrderedGraph& fine() const { return fine_; }

  // For each coarse cell, the measure-weighted mean of the vectors of its fine cells.
  Buffer<float> means_of(const PartVectors& vectors, ThreadTeam& team) const;
  // add_far_arcs, add_part_costs and set_lengths change the arcs of the coarse graph; see
  // far_arcs.hpp and OrderedGraph. `lengths` are in the order of the arcs.
  void add_far_arcs(ThreadTeam& team) { superfacets::add_far_arcs(graph_, kFarSteps, team); }
  void add_part_costs(const PartVectors& vectors, double factor, ThreadTeam& team) {
    graph_.add_part_costs(vectors, factor, team);
  }
  void set_lengths(std::span<const float> lengths, ThreadTeam& team);

  // The fine cells are divided into ranges of consecutive cells. No coarse cell extends beyond a
  // range.
  std::int64_t n_ranges() const { return std::ssize(first_cells_); }
  std::pair<Place, Place> places(std::int64_t range) const;
  // The coarse cells of a range, as a pair (first, one past the last).
  std::pair<Cell, Cell> cells_of(std::int64_t range) const {
    const bool is_last = range + 1 == n_ranges();
    return {first_cells_[range], is_last ? graph_.n_cells() : first_cells_[range + 1]};
  }
  Cell coarse_of(Place fine_place) const {
    return first_cells_[fine_place >> kRangeBits] + local_[fine_place];
  }

  // (N,) coarse cell of each fine cell, indexed by the input index of the fine cell. If `groups`
  // has a group of each coarse cell, the group of each fine cell instead.
  Buffer<Cell> coarse_cells(std::span<const Cell> groups, ThreadTeam& team) const;

  // Extends paths from coarse cells to fine cells. `lengths` and `labels` describe the path to each
  // coarse cell. A path to a fine cell is the shortest path that passes through the center of a
  // coarse cell or starts at a fine center. `centers` contains the fine center of each region. If
  // needs_lengths is false, the result contains only labels, and the memory of this object is
  // freed: the object must not be used again.
  SpreadPaths spread(std::span<const PathLength> lengths, std::span<const Label> labels,
                     std::span<const Cell> centers, bool needs_lengths, ThreadTeam& team);

  // The fine cell at the center of each coarse cell.
  std::vector<Cell> centers() const { return fine_.cells_at(centers_); }

  // For each region of coarse cells, the fine cell nearest to the mean position of the region; the
  // lowest cell if several are equally near. `labels` contains the label of each coarse cell, or
  // kNoLabel if the cell is in no region. `centers` contains one coarse cell of each region.
  std::vector<Cell> refine(std::span<const Label> labels, std::span<const Cell> centers,
                           ThreadTeam& team) const;

 private:
  // Each range of fine cells is divided independently of other ranges, so the result is the same
  // for any number of threads.
  static constexpr int kRangeBits = CellGrower::kRangeBits;
  using LocalCell = std::uint16_t;  // index of a coarse cell within its range
  static_assert(kRangeBits <= 16);

  struct Part;
  std::vector<Part> divide(Place cell_size, Buffer<float>& lengths, ThreadTeam& team);
  void number(std::span<const Part> parts);
  // Writes the positions and measures of all coarse cells, and frees the sums of the parts.
  void measure(std::span<Part> parts, Buffer<Point>& positions, Buffer<double>& measures,
               ThreadTeam& team) const;
  void connect(std::int64_t range, const CrossingLengths& lengths, Part& part) const;
  OrderedGraph joined(std::span<const Part> parts, PlacedCells cells, ThreadTeam& team) const;

  const OrderedGraph& fine_;
  std::vector<Cell> first_cells_;  // first coarse cell of each range
  Buffer<LocalCell> local_;        // (N,) coarse cell of each fine cell, in sorted order
  std::vector<Place> centers_;     // (C,) fine cell at the center of each coarse cell
  // The coarse graph. Input index and sorted index of a coarse cell are equal.
  OrderedGraph graph_;
};

}  // namespace superfacets
