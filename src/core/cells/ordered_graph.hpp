// A cell graph laid out for the cache; what stages 3 and 4 work on.
#pragma once

#include <vector>

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"
#include "cells/box_tree.hpp"

namespace superfacets {

// An arc as it is relaxed: where it leads and how long it is stand side by side.
struct Arc {
  Place to;
  float length;  // whole units >= 1
};

// The cells of a graph along a space-filling curve: cells that touch mostly stand on the same few
// pages of memory, in whatever order the input had them. All arrays are by place on the curve.
// 66 bytes a cell with three arcs.
class OrderedGraph {
 public:
  OrderedGraph(const CellGraph& graph, std::span<const double> measures, ThreadTeam& team);

  Cell n_cells() const { return static_cast<Cell>(cells.size()); }

  // The arcs that leave a place: rows of kRow where no cell has more, filled up with arcs to the
  // place itself, which never improve a path.
  static constexpr int kRow = 3;
  bool has_rows() const { return offsets.size() == 0; }
  std::span<const Arc> arcs_of(Place place) const {
    if (has_rows()) return arcs.span().subspan(std::size_t{kRow} * place, kRow);
    return arcs.span().subspan(offsets[place], offsets[place + 1] - offsets[place]);
  }

  // The nearest place to a point, the lowest cell among equals, of those that `is_wanted`. One that
  // is wanted has to be given; the nearer it is, the less is looked at.
  template <typename IsWanted>
  Place nearest(Point target, Place wanted, const IsWanted& is_wanted) const {
    Nearest nearest{wanted, squared_norm(positions[wanted] - target)};
    search(target, is_wanted, tree.n_levels() - 1, 0, nearest);
    return nearest.place;
  }

  std::vector<Place> places_of(std::span<const Cell> some_cells) const;
  std::vector<Cell> cells_at(std::span<const Place> places) const;

  Buffer<Cell> cells;            // (N,) the cell at each place
  Buffer<Place> place_of;        // (N,) by cell: its place
  Buffer<Point> positions;       // (N,)
  Buffer<double> measures;       // (N,)
  Buffer<std::int64_t> offsets;  // (N + 1,) into arcs; empty where there are rows
  Buffer<Arc> arcs;
  BoxTree tree;               // over the places
  Box bounds;                 // of the positions
  std::int64_t n_arcs = 0;    // without those that fill up
  double total_measure = 0;   // summed in blocks of cells, whatever the number of threads
  bool is_symmetric = false;  // each arc has one that leads back and is as long

 private:
  struct Nearest {
    Place place;
    double squared_distance;
  };

  template <typename IsWanted>
  void search(Point target, const IsWanted& is_wanted, std::size_t level, std::size_t index,
              Nearest& nearest) const {
    // A box just as far away may still hold a lower cell.
    if (tree.level(level)[index].squared_distance(target) > nearest.squared_distance) return;
    if (level > 0) {
      const auto [begin, end] = tree.children(level, index);
      for (auto child = begin; child < end; ++child) {
        search(target, is_wanted, level - 1, child, nearest);
      }
      return;
    }
    const auto [begin, end] = tree.places(index);
    for (auto place = begin; place < end; ++place) {
      const double squared = squared_norm(positions[place] - target);
      if (squared > nearest.squared_distance || !is_wanted(static_cast<Place>(place))) continue;
      if (squared == nearest.squared_distance && cells[place] >= cells[nearest.place]) continue;
      nearest = {static_cast<Place>(place), squared};
    }
  }

  void copy_cells(const CellGraph& graph, std::span<const double> input, ThreadTeam& team);
  void copy_rows(const CellGraph& graph, ThreadTeam& team);
  void copy_lists(const CellGraph& graph, ThreadTeam& team);
  std::size_t copy_arcs(const CellGraph& graph, Place place, std::size_t first);
  bool leads_back(Place from, const Arc& arc) const;
};

}  // namespace superfacets
