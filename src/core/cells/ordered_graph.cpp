#include "cells/ordered_graph.hpp"

#include <numeric>
#include <tuple>
#include <utility>

#include "cells/quantization.hpp"
#include "spatial/morton.hpp"

namespace superfacets {
namespace {

// Prefetch distances, in cells. Cells may be in random order in the input, and prefetching hides
// the cache misses. Offsets are prefetched kFarAhead cells ahead, and arcs kAhead cells ahead.
constexpr std::int64_t kAhead = 32;
constexpr std::int64_t kFarAhead = 64;

// Sort order of the arcs of a cell: by target, then by length. Sorted arcs allow binary search.
bool is_before(const Arc& a, const Arc& b) {
  return std::tie(a.to, a.length) < std::tie(b.to, b.length);
}

bool fits_rows(const WeightedArcs& input, ThreadTeam& team) {
  std::atomic<bool> fits = true;
  team.for_each_index(input.arcs.n_cells(), [&](Cell cell) {
    if (input.arcs.neighbors(cell).size() > OrderedGraph::kRow) fits = false;
  });
  return fits;
}

// Whether lengths are whole numbers with a limited sum, like the results of quantize_weights, so
// that path lengths are exact.
bool are_quantized(std::span<const float> lengths) {
  const auto is_whole = [](float length) { return length >= 1.0F && length == std::floor(length); };
  return std::ranges::all_of(lengths, is_whole) &&
         std::accumulate(lengths.begin(), lengths.end(), 0.0) < std::ldexp(1.0, kTotalBits + 1);
}

}  // namespace

PlacedCells::PlacedCells(std::span<const Point> input, std::span<const double> input_measures,
                         bool is_sorted, ThreadTeam& team)
    : bounds(bounds_of(input, team)),
      total_measure(sum_of(input_measures, team)),
      positions(input),
      measures(input_measures) {
  SUPERFACETS_ASSERT(input_measures.size() == input.size());
  if (!is_sorted) sort(team);
  tree = BoxTree(positions, team);
}

PlacedCells::PlacedCells(Buffer<Point> input, Buffer<double> input_measures, ThreadTeam& team)
    : bounds(bounds_of(input.span(), team)),
      total_measure(sum_of(input_measures.span(), team)),
      positions(input.span()),
      measures(input_measures.span()),
      tree(positions, team),
      own_positions_(std::move(input)),
      own_measures_(std::move(input_measures)) {}

// Sorts the cells along the curve. Positions and measures are copied.
void PlacedCells::sort(ThreadTeam& team) {
  cells = morton_order(positions, bounds, team);
  places = Buffer<Place>(cells.size());
  own_positions_ = Buffer<Point>(cells.size());
  own_measures_ = Buffer<double>(cells.size());
  team.for_each_index(n_cells(), [&](std::int64_t place) {
    if (place + kAhead < n_cells()) {
      const Cell later = cells[place + kAhead];
      prefetch(&positions[later]);
      prefetch(&measures[later]);
    }
    const Cell cell = cells[place];
    places[cell] = static_cast<Place>(place);
    own_positions_[place] = positions[cell];
    own_measures_[place] = measures[cell];
  });
  positions = own_positions_.span();
  measures = own_measures_.span();
}

OrderedGraph::OrderedGraph(PlacedCells&& placed, Buffer<std::int64_t> all_offsets,
                           Buffer<Arc> all_arcs, double unit)
    : PlacedCells(std::exchange(placed, {})),
      offsets(std::move(all_offsets)),
      arcs(std::move(all_arcs)),
      n_arcs(static_cast<std::int64_t>(arcs.size())),
      is_symmetric(true),
      straight_unit(unit),
      units_per_length(unit > 0.0 ? 1.0 / unit : 0.0) {
  SUPERFACETS_ASSERT(std::cmp_equal(offsets.size(), n_cells() + 1));
}

OrderedGraph::OrderedGraph(PlacedCells&& placed, const WeightedArcs& input, ThreadTeam& team)
    : PlacedCells(std::exchange(placed, {})),
      n_arcs(input.arcs.n_arcs()),
      straight_unit(input.straight_unit),
      units_per_length(straight_unit > 0.0 ? 1.0 / straight_unit : 0.0) {
  SUPERFACETS_ASSERT(input.arcs.are_valid() && input.arcs.n_cells() == n_cells());
  SUPERFACETS_ASSERT(input.arcs.n_arcs() == ssize(input.lengths) && are_quantized(input.lengths));
  if (input.are_shared) {
    SUPERFACETS_ASSERT(cells.size() == 0 && input.is_known_symmetric);
    shared_ = input;
  } else {
    copy_arcs(input, team);
  }
  SUPERFACETS_ASSERT(!input.is_known_symmetric || all_lead_back(team));
  is_symmetric = input.is_known_symmetric || all_lead_back(team);
}

void OrderedGraph::own_arcs(ThreadTeam& team) {
  if (shares_arcs()) copy_arcs(std::exchange(shared_, {}), team);
}

void OrderedGraph::copy_arcs(const WeightedArcs& input, ThreadTeam& team) {
  if (fits_rows(input, team)) {
    arcs = Buffer<Arc>(std::size_t{kRow} * n_cells());
  } else {
    arcs = Buffer<Arc>(n_arcs);
    offsets = Buffer<std::int64_t>(positions.size() + 1);
    offsets[0] = 0;
    for (Place place = 0; place < n_cells(); ++place) {
      offsets[place + 1] = offsets[place] + std::ssize(input.arcs.neighbors(cell_at(place)));
    }
  }
  has_rows() ? copy_rows(input, team) : copy_lists(input, team);
}

bool OrderedGraph::all_lead_back(ThreadTeam& team) const {
  std::atomic<bool> all = true;
  team.for_each_index(n_cells(), [&](Place place) {
    for (const Arc arc : arcs_of(place)) {
      if (!leads_back(place, arc)) all = false;
    }
  });
  return all;
}

void OrderedGraph::set_lengths(const WeightedArcs& input, ThreadTeam& team) {
  SUPERFACETS_ASSERT(std::ssize(input.lengths) == n_arcs && are_quantized(input.lengths));
  if (shares_arcs()) {
    shared_.lengths = input.lengths;
  } else {
    has_rows() ? copy_rows(input, team) : copy_lists(input, team);
  }
  SUPERFACETS_ASSERT(!is_symmetric || all_lead_back(team));
}

void OrderedGraph::copy_rows(const WeightedArcs& input, ThreadTeam& team) {
  team.for_each_index(n_cells(), [&](Place place) {
    prefetch_arcs(input, place);
    const std::size_t row = std::size_t{kRow} * place;
    const std::size_t n_copied = copy_arcs_of(input, place, row);
    std::fill_n(arcs.data() + row + n_copied, kRow - n_copied, Arc{place, 1.0F});
  });
}

void OrderedGraph::copy_lists(const WeightedArcs& input, ThreadTeam& team) {
  team.for_each_index(n_cells(), [&](Place place) {
    const std::size_t n_copied = copy_arcs_of(input, place, offsets[place]);
    Arc* list = arcs.data() + offsets[place];
    std::sort(list, list + n_copied, is_before);
  });
}

// Prefetches the data that copy_arcs will read for later cells.
void OrderedGraph::prefetch_arcs(const WeightedArcs& input, std::int64_t place) const {
  if (place + kFarAhead >= n_cells()) return;
  prefetch(&input.arcs.offsets[cell_at(place + kFarAhead)]);
  const std::int64_t first = input.arcs.offsets[cell_at(place + kAhead)];
  // Computes an address instead of indexing, because the index `first` may be out of range if the
  // cell has no arc.
  prefetch(input.arcs.targets.data() + first);
  prefetch(input.lengths.data() + first);
}

// Copies the arcs of the cell at `place` into the array of arcs, beginning at index `first`.
// Returns the number of copied arcs.
std::size_t OrderedGraph::copy_arcs_of(const WeightedArcs& input, Place place, std::size_t first) {
  std::size_t next = first;
  for (const auto [arc, neighbor] : input.arcs.steps(cell_at(place))) {
    arcs[next++] = {place_of(neighbor), input.lengths[arc]};
  }
  return next - first;
}

void OrderedGraph::add_part_costs(const PartVectors& vectors, double factor, ThreadTeam& team) {
  SUPERFACETS_ASSERT(vectors.groups.empty() || vectors.groups.size() == positions.size());
  SUPERFACETS_ASSERT(!vectors.groups.empty() ||
                     vectors.rows.size() == vectors.width * positions.size());
  own_arcs(team);
  Buffer<Cell> groups(positions.size());  // group of each cell, in sorted order
  team.for_each_index(n_cells(),
                      [&](Place place) { groups[place] = vectors.group_of(cell_at(place)); });
  team.for_each_slow(n_cells(), [&](Place place) {
    const Cell here = groups[place];
    for (Arc& arc : arcs.span().subspan(first_arc(place), arcs_of(place).size())) {
      const Cell there = groups[arc.to];
      if (there == here) continue;  // arcs within a group and padding arcs do not change
      arc.length = with_cost(arc.length, factor, vectors.distance(here, there));
    }
  });
}

std::vector<Place> OrderedGraph::places_of(std::span<const Cell> some_cells) const {
  std::vector<Place> found;
  found.reserve(some_cells.size());
  for (const Cell cell : some_cells) found.push_back(place_of(cell));
  return found;
}

std::vector<Cell> OrderedGraph::cells_at(std::span<const Place> some_places) const {
  std::vector<Cell> some_cells;
  some_cells.reserve(some_places.size());
  for (const Place place : some_places) some_cells.push_back(cell_at(place));
  return some_cells;
}

bool OrderedGraph::leads_back(Place from, const Arc& arc) const {
  const auto back = arcs_of(arc.to);
  const Arc wanted{from, arc.length};
  if (!has_rows() && !shares_arcs()) {
    const std::span<const Arc> sorted{arcs.data() + offsets[arc.to], back.size()};
    return std::ranges::binary_search(sorted, wanted, is_before);
  }
  for (const Arc other : back) {
    if (other.to == wanted.to && other.length == wanted.length) return true;
  }
  return false;
}

}  // namespace superfacets
