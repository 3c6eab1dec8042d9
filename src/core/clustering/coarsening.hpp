// A smaller graph of larger cells, on which most of the loop can run.
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

// Paths by cell; the label is kNoLabel where there is none.
struct SpreadPaths {
  Buffer<PathLength> lengths;
  Buffer<Label> labels;
};

// The cells of a graph (fine), grouped into coarse cells: connected, each around a center. A coarse
// cell has the sum of their measures and the mean of their positions. An arc between two coarse
// cells is as long as the shortest path from center to center that crosses their border once. Every
// component of the fine graph, however small, has at least one coarse cell.
//
// If steps of the fine graph are straight, so are those of this one: an arc is as long as the
// straight line between the positions of two coarse cells plus the lowest price of such a path, and
// no coarse cell extends across an arc with a price of fine.barrier or more.
// Shortest paths are then about as long in all directions, whatever the pattern of the fine cells.
class CoarseGraph {
 public:
  // Coarse cells of about `cell_size` cells. The fine graph must be symmetric, and must outlive
  // this one. Memory: 2 bytes per fine cell beside the graph, 6 during construction.
  CoarseGraph(const OrderedGraph& fine, Place cell_size, ThreadTeam& team);

  const OrderedGraph& graph() const { return graph_; }
  const OrderedGraph& fine() const { return fine_; }

  // Means of rows of `width` numbers of the fine cells, weighted by their measures, by coarse cell.
  Buffer<float> means_of(std::span<const float> rows, std::size_t width, ThreadTeam& team) const;
  // Change the arcs of the graph, for the loop; see far_arcs.hpp and OrderedGraph.
  void add_far_arcs(ThreadTeam& team) { superfacets::add_far_arcs(graph_, team); }
  void add_part_prices(const PartVectors& vectors, double factor, ThreadTeam& team) {
    graph_.add_part_prices(vectors, factor, team);
  }

  // Coarse cells do not extend beyond ranges of fine places.
  std::int64_t n_ranges() const { return std::ssize(first_cells_); }
  std::pair<Place, Place> places(std::int64_t range) const;
  // The coarse cells of a range: the first, and one past the last.
  std::pair<Cell, Cell> cells_of(std::int64_t range) const {
    const bool is_last = range + 1 == n_ranges();
    return {first_cells_[range], is_last ? graph_.n_cells() : first_cells_[range + 1]};
  }
  Cell coarse_of(Place fine_place) const {
    return first_cells_[fine_place >> kRangeBits] + local_[fine_place];
  }

  // The coarse cell of each fine cell, by cell.
  Buffer<Cell> coarse_cells(ThreadTeam& team) const;

  // Paths to fine cells: over the coarse cell for which the sum of its own path and of the path on
  // from its center is the shortest. The given paths are by coarse cell. `centers` holds a fine
  // cell of each region, which gets a path as long as its offset; without offsets, of length 0.
  SpreadPaths spread(std::span<const PathLength> lengths, std::span<const Label> labels,
                     std::span<const Cell> centers, std::span<const PathLength> offsets,
                     ThreadTeam& team) const;

  // The fine cell at the center of each coarse cell.
  std::vector<Cell> centers() const { return fine_.cells_at(centers_); }

  // Centers among fine cells for regions of coarse cells: for each region the fine cell nearest to
  // its mean, the lowest among equals. `labels` are by coarse cell, kNoLabel for cells in no
  // region; `centers` holds a coarse cell of each region.
  std::vector<Cell> refine(std::span<const Label> labels, std::span<const Cell> centers,
                           ThreadTeam& team) const;

 private:
  // Coarse cells are made range by range, on any number of threads.
  static constexpr int kRangeBits = CellGrower::kRangeBits;
  using LocalCell = std::uint16_t;  // counted from the first of a range
  static_assert(kRangeBits <= 16);

  struct Part;
  std::vector<Part> divide(Place cell_size, Buffer<float>& lengths, ThreadTeam& team);
  void number(std::span<const Part> parts);
  Buffer<Point> positions(std::span<const Part> parts, ThreadTeam& team) const;
  void connect(std::int64_t range, const CrossingLengths& lengths, Part& part) const;
  OrderedGraph joined(std::span<const Part> parts, Buffer<Point> positions, ThreadTeam& team) const;

  const OrderedGraph& fine_;
  std::vector<Cell> first_cells_;  // by range: its first coarse cell
  Buffer<LocalCell> local_;        // (N,) the coarse cell of each fine place
  std::vector<Place> centers_;     // (C,) fine places
  OrderedGraph graph_;  // places are cells, because coarse cells are made in the order of the curve
};

// The measure-weighted mean of the positions of each region of coarse cells, summed in their order;
// cells with kNoLabel are in no region.
std::vector<Point> region_means(const OrderedGraph& coarse, std::span<const Label> labels,
                                std::int64_t n_regions);

}  // namespace superfacets
