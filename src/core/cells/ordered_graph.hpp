// A cell graph laid out for the cache: the input of stages 3 and 4.
#pragma once

#include <limits>

#include "cells/arcs.hpp"
#include "cells/part_prices.hpp"
#include "spatial/box_tree.hpp"

namespace superfacets {

// An arc in the layout for relaxation: target and length are adjacent in memory.
struct Arc {
  Place to;
  float length;  // whole units >= 1
};

// Strict upper bound of path lengths. Shortest paths are shorter than 2^kTotalBits units, and a
// detour at most doubles a path. A path through a coarse cell consists of paths of finer cells to
// and from its center, so each of the few levels at most doubles path lengths.
inline constexpr PathLength kLongest = PathLength{1} << 60;

// Length of a path extended by an arc.
inline PathLength longer_by(PathLength length, const Arc& arc) {
  SUPERFACETS_ASSERT(length < kLongest);
  // Converts via a signed integer, because processors have an instruction for that.
  return length + static_cast<PathLength>(static_cast<std::int64_t>(arc.length));
}

// Arcs of the input.
struct WeightedArcs {
  Arcs arcs;
  std::span<const float> lengths;  // (M,) whole units >= 1, from quantize_weights
  // true: each arc has a reverse arc of equal length, which is not checked
  bool is_known_symmetric = false;
  double straight_unit = 0.0;  // see OrderedGraph
};

// Cells sorted along a space-filling curve, so neighbors are near in memory for any order of the
// input. The place of a cell is its index on the curve. All arrays are indexed by place, except
// place_of. This object is built before the graph, so the positions and measures of the input can
// be freed before arcs are copied.
struct PlacedCells {
  PlacedCells() = default;  // no cells
  PlacedCells(std::span<const Point> positions, std::span<const double> measures, ThreadTeam& team);

  // For cells that are already sorted, exactly or nearly. The place of a cell is its index.
  PlacedCells(Buffer<Point> positions, Buffer<double> measures, ThreadTeam& team);

  Cell n_cells() const { return static_cast<Cell>(cells.size()); }

  Box bounds;                // bounding box of the positions
  double total_measure = 0;  // summed in fixed blocks, the same for any number of threads
  Buffer<Cell> cells;        // (N,) the cell at each place
  Buffer<Place> place_of;    // (N,) place of each cell
  Buffer<Point> positions;   // (N,)
  Buffer<double> measures;   // (N,)
  BoxTree tree;              // bounding boxes over the places
};

// Placed cells with the arcs between them. Takes 66 bytes per cell with three arcs.
class OrderedGraph : public PlacedCells {
 public:
  OrderedGraph() = default;  // no cells
  OrderedGraph(PlacedCells&& cells, const WeightedArcs& input, ThreadTeam& team);

  // For arcs between places, in lists sorted by target. Each arc must have a reverse arc of equal
  // length.
  OrderedGraph(PlacedCells&& cells, Buffer<std::int64_t> offsets, Buffer<Arc> arcs,
               double straight_unit = 0.0);

  // The arcs that leave a place. If no cell has more than kRow arcs, arcs are stored in rows of
  // kRow entries. Padding arcs lead to the place itself, and never improve a path.
  static constexpr int kRow = 3;
  bool has_rows() const { return offsets.size() == 0; }
  std::span<const Arc> arcs_of(Place place) const {
    SUPERFACETS_ASSERT(place >= 0 && place < n_cells());
    if (has_rows()) return arcs.span().subspan(first_arc(place), kRow);
    return arcs.span().subspan(first_arc(place), offsets[place + 1] - offsets[place]);
  }

  // The price of an arc: its length minus the distance of its ends, in units of length.
  double price(Place from, const Arc& arc) const {
    const double straight = norm(positions[arc.to] - positions[from]) / straight_unit;
    return std::max(0.0, static_cast<double>(arc.length) - straight);
  }

  // Adds the price of the distance in `vectors` to each arc (see part_prices.hpp).
  void add_part_prices(const PartVectors& vectors, double factor, ThreadTeam& team);

  std::vector<Place> places_of(std::span<const Cell> some_cells) const;
  std::vector<Cell> cells_at(std::span<const Place> places) const;

  Buffer<std::int64_t> offsets;  // (N + 1,) into arcs; empty if arcs are in rows
  Buffer<Arc> arcs;
  std::int64_t n_arcs = 0;    // number of arcs without padding
  bool is_symmetric = false;  // each arc has a reverse arc of equal length
  // If straight_unit is positive, the length of an arc is the distance of its ends plus a price,
  // and straight_unit is the size of one unit of length in the unit of the positions. If it is 0,
  // arcs may have any lengths.
  double straight_unit = 0.0;
  // Coarse cells do not extend across arcs with at least this price.
  double barrier = HUGE_VAL;

 private:
  std::size_t first_arc(Place place) const {
    return has_rows() ? std::size_t{kRow} * place : offsets[place];
  }
  void copy_rows(const WeightedArcs& input, ThreadTeam& team);
  void copy_lists(const WeightedArcs& input, ThreadTeam& team);
  void prefetch_arcs(const WeightedArcs& input, std::int64_t place) const;
  std::size_t copy_arcs(const WeightedArcs& input, Place place, std::size_t first);
  bool leads_back(Place from, const Arc& arc) const;
  bool all_lead_back(ThreadTeam& team) const;
};

// Search for the place nearest to a point. Ties go to the lowest cell.
class NearestPlace {
 public:
  // Starts with `place`. A place near the target makes the search fast.
  NearestPlace(const OrderedGraph& graph, Point target, Place place)
      : graph_(&graph),
        target_(target),
        place_(place),
        squared_(squared_norm(graph.positions[place] - target)) {}

  Place place() const { return place_; }

  void offer(Place place) {
    const double squared = squared_norm(graph_->positions[place] - target_);
    if (is_nearer(place, squared)) set(place, squared);
  }

  // Searches all places for which is_wanted holds. Returns false if the search needs more than
  // n_visits nodes of the tree.
  template <typename IsWanted>
  bool search(const IsWanted& is_wanted, std::int64_t n_visits) {
    // A box at an equal distance may hold a cell with a lower index, so the comparison is <=.
    const auto may_hold = [&](std::size_t level, std::size_t index) {
      return graph_->tree.level(level)[index].squared_distance(target_) <= squared_ &&
             --n_visits >= 0;
    };
    graph_->tree.visit_leaves(may_hold, [&](std::size_t leaf) {
      const auto [begin, end] = graph_->tree.places(leaf);
      for (auto place = static_cast<Place>(begin); std::cmp_less(place, end); ++place) {
        const double squared = squared_norm(graph_->positions[place] - target_);
        if (squared > squared_ || !is_wanted(place)) continue;
        if (is_nearer(place, squared)) set(place, squared);
      }
    });
    return n_visits >= 0;
  }

 private:
  bool is_nearer(Place place, double squared) const {
    return squared < squared_ ||
           (squared == squared_ && graph_->cells[place] < graph_->cells[place_]);
  }
  void set(Place place, double squared) {
    place_ = place;
    squared_ = squared;
  }

  const OrderedGraph* graph_;
  Point target_;
  Place place_;
  double squared_;  // distance
};

}  // namespace superfacets
