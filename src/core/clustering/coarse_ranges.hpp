// Builds the coarse cells of one range of fine cells, and the arcs that leave them.
#pragma once

#include <tuple>

#include "base/lists.hpp"
#include "clustering/cell_grower.hpp"
#include "clustering/sums.hpp"

namespace superfacets {

// The coarse cells of a range.
struct RangeCells {
  std::vector<Place> centers;     // fine cell at the center of each coarse cell
  std::vector<WeightedSum> sums;  // positions and measures of the fine cells of each coarse cell
};

// The arcs that leave the coarse cells of a range.
struct RangeArcs {
  std::vector<std::int64_t> ends;  // one past the last arc of each coarse cell
  std::vector<Arc> arcs;           // arcs to other coarse cells
};

// Divides the fine cells begin .. end-1 into coarse cells. Calls write(place, cell, length) for
// each fine cell. `cell` is the index of the coarse cell within the range. `length` is the length
// of the path from the center of the coarse cell to the fine cell. If the graph has a straight_unit
// > 0, `length` is the sum of the crease costs on this path instead.
template <typename Write>
RangeCells divide_range(const OrderedGraph& fine, CellGrower& grower, Place begin, Place end,
                        const Write& write) {
  grower.divide(begin, end);
  RangeCells cells;
  cells.centers.assign(grower.centers().begin(), grower.centers().end());
  cells.sums.resize(cells.centers.size());
  const bool has_costs = fine.straight_unit > 0.0;
  for (Place place = begin; place < end; ++place) {
    const std::size_t cell = grower.cell(place);
    write(place, cell,
          has_costs ? grower.crease_cost(place) : static_cast<float>(grower.length(place)));
    cells.sums[cell].add(fine.positions[place], fine.measures[place]);
  }
  return cells;
}

// Appends an arc. If one of the last kSearched arcs has the same target, that arc gets the lower
// length of the two instead. A coarse cell has few neighbors, so few parallel arcs remain to be
// sorted.
inline void add_or_shorten(std::vector<Arc>& arcs, const Arc& arc) {
  constexpr std::size_t kSearched = 8;
  const std::size_t end = arcs.size() - std::min(arcs.size(), kSearched);
  for (std::size_t i = arcs.size(); i-- > end;) {
    if (arcs[i].to != arc.to) continue;
    arcs[i].length = std::min(arcs[i].length, arc.length);
    return;
  }
  arcs.push_back(arc);
}

// Sorts arcs by target, and keeps only the shortest arc to each target.
inline void remove_parallel(std::vector<Arc>& arcs) {
  std::sort(arcs.begin(), arcs.end(), [](const Arc& a, const Arc& b) {
    return std::tie(a.to, a.length) < std::tie(b.to, b.length);
  });
  const auto end = std::unique(arcs.begin(), arcs.end(),
                               [](const Arc& a, const Arc& b) { return a.to == b.to; });
  arcs.erase(end, arcs.end());
}

// Computes lengths of arcs between coarse cells. If the graph has a straight_unit > 0 (see
// OrderedGraph), the length of an arc is the straight distance between the positions of its cells,
// plus the lowest crease cost of a path across their border.
struct CrossingLengths {
  const OrderedGraph& fine;
  // (N,) `length` of each fine cell, as defined at divide_range.
  std::span<const float> from_center;
  std::span<const Point> positions;  // positions of coarse cells; empty if straight_unit is 0

  // The length (or crease cost, if straight_unit > 0) of the path from center to center via an arc
  // between fine cells. The values at both ends are added first, so that both directions of the arc
  // give bit-identical results.
  float across(Place place, const Arc& arc) const {
    const float ends = from_center[place] + from_center[arc.to];
    return positions.empty() ? ends + arc.length
                             : ends + static_cast<float>(fine.crease_cost(place, arc));
  }
  // The length of a coarse arc, given the minimum of across() over all fine arcs between its two
  // cells.
  float of(Cell from, Cell to, float least) const {
    if (positions.empty()) return least;
    const double straight = norm(positions[to] - positions[from]) * fine.units_per_length;
    return static_cast<float>(std::max(1.0, round_to_whole(straight + double{least})));
  }
};

// Returns the arcs that leave the coarse cells first .. first+n_cells-1, which consist of the fine
// cells begin .. end-1. coarse_of(place) must return the coarse cell of any fine cell that is in
// this range or adjacent to the range.
template <typename CoarseOf>
RangeArcs connect_range(std::pair<Place, Place> range,
                        std::pair<Cell, std::size_t> first_and_number, const CoarseOf& coarse_of,
                        const CrossingLengths& lengths) {
  const OrderedGraph& fine = lengths.fine;
  const auto [begin, end] = range;
  const auto [first, n_cells] = first_and_number;
  const auto add_places = [&, begin = begin, end = end, first = first](const auto& add) {
    for (Place place = begin; place < end; ++place) add(coarse_of(place) - first, place);
  };
  const Lists<Place> members = group<Place>(static_cast<std::int64_t>(n_cells), add_places);
  RangeArcs connected;
  std::vector<Arc> leaving;
  for (std::size_t cell = 0; cell < n_cells; ++cell) {
    const Cell from = first + static_cast<Cell>(cell);
    leaving.clear();
    for (const Place place : members[static_cast<std::int64_t>(cell)]) {
      if (place + 64 < fine.n_cells()) fine.arcs_of(place + 64).prefetch();
      fine.arcs_of(place).for_each([&](std::size_t, Arc arc) {
        const Cell to = coarse_of(arc.to);
        if (to != from) add_or_shorten(leaving, {to, lengths.across(place, arc)});
      });
    }
    remove_parallel(leaving);
    for (Arc& arc : leaving) arc.length = lengths.of(from, arc.to, arc.length);
    connected.arcs.insert(connected.arcs.end(), leaving.begin(), leaving.end());
    connected.ends.push_back(std::ssize(connected.arcs));
  }
  return connected;
}

}  // namespace superfacets
