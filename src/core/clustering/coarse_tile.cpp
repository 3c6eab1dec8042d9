#include "clustering/coarse_tile.hpp"

#include "clustering/coarse_ranges.hpp"

namespace superfacets {
namespace {

std::int64_t n_ranges(Place n_own) {
  return ((std::int64_t{n_own} - 1) >> CellGrower::kRangeBits) + 1;
}

std::pair<Place, Place> places_of_range(std::int64_t range, Place n_own) {
  const auto begin = static_cast<Place>(range << CellGrower::kRangeBits);
  return {begin, std::min(begin + (1 << CellGrower::kRangeBits), n_own)};
}

// Concatenates the coarse cells of all ranges. The coarse cells are numbered from the first coarse
// cell of the tile.
TileCells joined(std::span<const RangeCells> parts, Buffer<Cell> of, Buffer<float> lengths) {
  TileCells cells;
  for (const RangeCells& part : parts) {
    cells.centers.insert(cells.centers.end(), part.centers.begin(), part.centers.end());
  }
  cells.positions = Buffer<Point>(cells.centers.size());
  cells.measures = Buffer<double>(cells.centers.size());
  std::size_t first = 0;
  for (std::size_t range = 0; range < parts.size(); ++range) {
    const auto [begin, end] =
        places_of_range(static_cast<std::int64_t>(range), static_cast<Place>(of.size()));
    for (Place place = begin; place < end; ++place) of[place] += static_cast<Cell>(first);
    for (const WeightedSum& sum : parts[range].sums) {
      cells.positions[first] = sum.mean();
      cells.measures[first++] = sum.measure;
    }
  }
  cells.of = std::move(of);
  cells.lengths = std::move(lengths);
  return cells;
}

}  // namespace

TileCells divide_tile(const OrderedGraph& tile, Place n_own, Place cell_size, ThreadTeam& team) {
  SUPERFACETS_ASSERT(n_own >= 1 && n_own <= tile.n_cells() && cell_size >= 1);
  std::vector<RangeCells> parts(n_ranges(n_own));
  // (n_own,) coarse cell of each fine cell, as an index within its range
  Buffer<Cell> of(n_own);
  Buffer<float> lengths(n_own);
  PerThread<CellGrower> growers(team.size());
  team.for_each(std::ssize(parts), [&](std::int64_t range, int thread) {
    const auto [begin, end] = places_of_range(range, n_own);
    const auto write = [&](Place place, std::size_t cell, float length) {
      of[place] = static_cast<Cell>(cell);
      lengths[place] = length;
    };
    parts[range] = divide_range(tile, growers.get(thread, tile, cell_size), begin, end, write);
  });
  return joined(parts, std::move(of), std::move(lengths));
}

TileArcs connect_tile(const OrderedGraph& tile, Place n_own, std::span<const Cell> coarse,
                      std::span<const float> lengths, std::span<const Point> positions,
                      ThreadTeam& team) {
  SUPERFACETS_ASSERT(std::cmp_equal(coarse.size(), tile.n_cells()) &&
                     lengths.size() == coarse.size());
  const bool is_straight = tile.straight_unit > 0.0;
  const CrossingLengths crossing{tile, lengths, is_straight ? positions : std::span<const Point>()};
  std::vector<RangeArcs> parts(n_ranges(n_own));
  team.for_each(std::ssize(parts), [&](std::int64_t range, int) {
    const auto [begin, end] = places_of_range(range, n_own);
    const auto [lowest, highest] =
        std::minmax_element(coarse.begin() + begin, coarse.begin() + end);
    const auto n_cells = static_cast<std::size_t>(*highest - *lowest) + 1;
    const auto coarse_of = [&](Place place) { return coarse[place]; };
    parts[range] = connect_range({begin, end}, {*lowest, n_cells}, coarse_of, crossing);
  });
  TileArcs joined{{0}, {}};
  for (const RangeArcs& part : parts) {
    const std::int64_t first = joined.offsets.back();
    for (const std::int64_t end : part.ends) joined.offsets.push_back(first + end);
    joined.arcs.insert(joined.arcs.end(), part.arcs.begin(), part.arcs.end());
  }
  return joined;
}

NearestOfRegions nearest_of_regions(std::span<const Point> positions, std::span<const Cell> cells,
                                    std::span<const Label> labels, std::span<const Point> targets) {
  SUPERFACETS_ASSERT(cells.size() == positions.size() && labels.size() == positions.size());
  NearestOfRegions nearest{std::vector<double>(targets.size(), kInfinity),
                           std::vector<Cell>(targets.size(), kNoCell)};
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const Label label = labels[i];
    if (label == kNoLabel) continue;
    const double squared = squared_norm(positions[i] - targets[label]);
    if (squared > nearest.squared_distances[label]) continue;
    Cell& cell = nearest.cells[label];
    if (squared == nearest.squared_distances[label] && cell != kNoCell && cell < cells[i]) continue;
    nearest.squared_distances[label] = squared;
    cell = cells[i];
  }
  return nearest;
}

}  // namespace superfacets
