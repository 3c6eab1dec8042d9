// A cell graph with a cache-friendly layout: the input of stages 3 and 4.
#pragma once

#include <ranges>

#include "base/prefetch.hpp"
#include "cells/part_costs.hpp"
#include "spatial/box_tree.hpp"

namespace superfacets {

// An arc of a graph. Target and length are adjacent in memory, because relaxation reads both.
struct Arc {
  Place to;      // target cell
  float length;  // quantized length, a whole number >= 1
};

// Strict upper bound of path lengths. Shortest paths are shorter than 2^kTotalBits units. Each
// coarse level of the graph (coarse_graph.hpp) at most doubles path lengths, and there are few
// levels.
inline constexpr PathLength kLongest = PathLength{1} << 60;

// The arcs that leave a cell. Targets and lengths are in one array of Arc, or in two arrays.
class ArcList {
 public:
  struct Iterator {
    const Place* to;
    const float* length;
    std::ptrdiff_t stride;

    Arc operator*() const { return {*to, *length}; }
    Iterator& operator++() {
      to += stride;
      length += stride;
      return *this;
    }
    bool operator!=(const Iterator& other) const { return to != other.to; }
  };

  ArcList(const Arc* arcs, std::size_t size)
      : to_(&arcs->to), length_(&arcs->length), stride_(2), size_(size) {
    static_assert(sizeof(Arc) == 2 * sizeof(Place) && sizeof(Place) == sizeof(float));
  }
  ArcList(const Place* targets, const float* lengths, std::size_t size)
      : to_(targets), length_(lengths), stride_(1), size_(size) {}

  // Calls visit(i, arc) for all arcs, faster than an iterator.
  template <typename Visit>
  SUPERFACETS_ALWAYS_INLINE void for_each(const Visit& visit) const {
    if (stride_ == 2) {
      for (std::size_t i = 0; i < size_; ++i) visit(i, Arc{to_[2 * i], length_[2 * i]});
    } else {
      for (std::size_t i = 0; i < size_; ++i) visit(i, Arc{to_[i], length_[i]});
    }
  }
  std::size_t size() const { return size_; }
  Iterator begin() const { return {to_, length_, stride_}; }
  Iterator end() const {
    return {to_ + stride_ * static_cast<std::ptrdiff_t>(size_), length_, stride_};
  }
  void prefetch() const {
    superfacets::prefetch(to_);
    superfacets::prefetch(length_);
  }

 private:
  const Place* to_;
  const float* length_;
  std::ptrdiff_t stride_;  // distance in memory between consecutive targets, and lengths
  std::size_t size_;
};

// Length of a path extended by an arc.
inline PathLength longer_by(PathLength length, const Arc& arc) {
  SUPERFACETS_ASSERT(length < kLongest);
  // Converts via a signed integer, because this conversion is a single instruction.
  return length + static_cast<PathLength>(static_cast<std::int64_t>(arc.length));
}

// Arcs between cells with quantized lengths, as given by the caller.
struct WeightedArcs {
  Arcs arcs;
  std::span<const float> lengths;  // (M,) whole numbers >= 1, from quantize_weights
  // the caller guarantees that each arc has a reverse arc of equal length
  bool is_known_symmetric = false;
  // The unit of `lengths`, in the unit of the positions, or 0 if the lengths are arbitrary. See
  // OrderedGraph::straight_unit.
  double straight_unit = 0.0;
  // If true, the graph refers to the arrays of the caller, as long as lengths do not change: 8
  // bytes per arc less, but slower searches. The cells must be sorted, and the arcs symmetric.
  bool are_shared = false;
};

// Cells sorted along a space-filling curve, so that neighbors are near in memory for any order of
// the input. The place of a cell is its index in the sorted order. All arrays except places are in
// the sorted order.
struct PlacedCells {
  PlacedCells() = default;  // creates an object without cells
  // If `is_sorted`, the cells are in a spatial order already, which is kept. Positions and measures
  // are then not copied: the object refers to the arrays of the caller.
  PlacedCells(std::span<const Point> positions, std::span<const double> measures, bool is_sorted,
              ThreadTeam& team);

  // This constructor keeps the order of the cells, which must already be a spatial order.
  PlacedCells(Buffer<Point> positions, Buffer<double> measures, ThreadTeam& team);

  Cell n_cells() const { return static_cast<Cell>(positions.size()); }
  // Input index of a sorted cell, and the inverse.
  Cell cell_at(Place place) const { return cells.size() == 0 ? place : cells[place]; }
  Place place_of(Cell cell) const { return places.size() == 0 ? cell : places[cell]; }
  // Index of each input cell in the sorted order.
  auto in_input_order() const {
    return std::views::iota(Cell{0}, n_cells()) |
           std::views::transform([this](Cell cell) { return place_of(cell); });
  }

  Box bounds;                        // bounding box of the positions
  double total_measure = 0;          // sum of `measures`, the same for any number of threads
  Buffer<Cell> cells;                // (N,) values of cell_at; empty if the input was sorted
  Buffer<Place> places;              // (N,) values of place_of; empty if the input was sorted
  std::span<const Point> positions;  // (N,) position of each sorted cell
  std::span<const double> measures;  // (N,) area or volume of each sorted cell
  BoxTree tree;                      // hierarchy of bounding boxes of the sorted cells

 private:
  void sort(ThreadTeam& team);

  Buffer<Point> own_positions_;  // memory of `positions`, unless the caller owns it
  Buffer<double> own_measures_;  // memory of `measures`, likewise
};

// Sorted cells with the arcs between them. Uses 66 bytes per cell if cells have three arcs, 26 if
// the input was sorted, or 2 if arcs are shared, too.
class OrderedGraph : public PlacedCells {
 public:
  OrderedGraph() = default;  // creates a graph without cells
  OrderedGraph(PlacedCells&& cells, const WeightedArcs& input, ThreadTeam& team);

  // Constructor for arcs between sorted cells, in lists sorted by target. Each arc must have a
  // reverse arc of equal length.
  OrderedGraph(PlacedCells&& cells, Buffer<std::int64_t> offsets, Buffer<Arc> arcs,
               double straight_unit = 0.0);

  // If no cell has more than kRow arcs, arcs are stored in rows of kRow entries, which may include
  // padding. A padding arc leads from a cell to itself, so it never shortens a path.
  static constexpr int kRow = 3;
  bool has_rows() const { return offsets.size() == 0 && !shares_arcs(); }
  bool shares_arcs() const { return !shared_.arcs.offsets.empty(); }
  ArcList arcs_of(Place place) const {
    SUPERFACETS_ASSERT(place >= 0 && place < n_cells());
    if (has_rows()) return {arcs.data() + first_arc(place), kRow};
    if (!shares_arcs()) {
      return {arcs.data() + offsets[place],
              static_cast<std::size_t>(offsets[place + 1] - offsets[place])};
    }
    const std::int64_t first = shared_.arcs.offsets[place];
    return {shared_.arcs.targets.data() + first, shared_.lengths.data() + first,
            static_cast<std::size_t>(shared_.arcs.offsets[place + 1] - first)};
  }

  // Index in `arcs` of the first arc of a cell. Arcs must not be shared.
  std::size_t first_arc(Place place) const {
    return has_rows() ? std::size_t{kRow} * place : offsets[place];
  }

  // Prefetches where the arcs of a cell begin, before arcs_of(place).prefetch().
  void prefetch_start(Place place) const {
    if (shares_arcs()) superfacets::prefetch(&shared_.arcs.offsets[place]);
  }

  // Copies shared arcs, so that they can be changed.
  void own_arcs(ThreadTeam& team);

  // Crease cost of an arc: its length minus the straight distance between its ends, in quantized
  // units.
  double crease_cost(Place from, const Arc& arc) const {
    const double straight = norm(positions[arc.to] - positions[from]) * units_per_length;
    return std::max(0.0, static_cast<double>(arc.length) - straight);
  }

  // Replaces the lengths of arcs. `input` has the arcs from which the graph was built, and are
  // shared if they were. If is_symmetric, reverse arcs must again have equal lengths.
  void set_lengths(const WeightedArcs& input, ThreadTeam& team);

  // Adds factor |psi_i - psi_j| to the length of each arc from cell i to cell j, where psi_i is the
  // vector of cell i in `vectors` (see part_costs.hpp).
  void add_part_costs(const PartVectors& vectors, double factor, ThreadTeam& team);

  std::vector<Place> places_of(std::span<const Cell> some_cells) const;
  std::vector<Cell> cells_at(std::span<const Place> some_places) const;

  // (N + 1,) start of each cell in `arcs`; empty if arcs are in rows or shared
  Buffer<std::int64_t> offsets;
  Buffer<Arc> arcs;           // empty if arcs are shared
  std::int64_t n_arcs = 0;    // number of arcs without padding
  bool is_symmetric = false;  // whether each arc has a reverse arc of equal length
  // If positive: the length of an arc is the straight distance between its ends plus a crease cost,
  // and straight_unit is one quantized unit in the unit of the positions. If 0: arcs have arbitrary
  // lengths.
  double straight_unit = 0.0;
  double units_per_length = 0.0;  // 1 / straight_unit, or 0
  // Coarse cells do not extend across arcs whose crease cost is at least this value (see
  // coarse_graph.hpp).
  double crease_limit = HUGE_VAL;

 private:
  void copy_arcs(const WeightedArcs& input, ThreadTeam& team);
  void copy_rows(const WeightedArcs& input, ThreadTeam& team);
  void copy_lists(const WeightedArcs& input, ThreadTeam& team);
  void prefetch_arcs(const WeightedArcs& input, std::int64_t place) const;
  std::size_t copy_arcs_of(const WeightedArcs& input, Place place, std::size_t first);
  bool leads_back(Place from, const Arc& arc) const;
  bool all_lead_back(ThreadTeam& team) const;

  WeightedArcs shared_;  // arcs of the caller; empty if arcs are not shared
};

// Search for the cell nearest to a point. If several cells are equally near, the cell with the
// lowest input index is found.
class NearestPlace {
 public:
  // `place` is the first candidate. The search is fast if this cell is near the target.
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

  // Searches all cells for which is_wanted(place) is true. Returns false if the search stops early,
  // because it would visit more than n_visits nodes of the tree.
  template <typename IsWanted>
  bool search(const IsWanted& is_wanted, std::int64_t n_visits) {
    // A box at an equal distance may contain a cell with a lower index, so the comparison is <=.
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
           (squared == squared_ && graph_->cell_at(place) < graph_->cell_at(place_));
  }
  void set(Place place, double squared) {
    place_ = place;
    squared_ = squared;
  }

  const OrderedGraph* graph_;
  Point target_;
  Place place_;
  double squared_;  // squared distance from the target to place_
};

}  // namespace superfacets
