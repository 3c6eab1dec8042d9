#include "clustering/coarse_graph.hpp"

#include "clustering/nearest_members.hpp"

namespace superfacets {
namespace {

// Minimum weight of a fine cell in means_of. The weight is positive, so that the mean is defined
// even if the measures of all fine cells are 0.
constexpr double kMinMeasure = 1e-300;

// The measure-weighted mean position of each region of coarse cells. Cells with kNoLabel are in no
// region.
std::vector<Point> region_means(const OrderedGraph& coarse, std::span<const Label> labels,
                                std::int64_t n_regions) {
  SUPERFACETS_ASSERT(std::cmp_equal(labels.size(), coarse.n_cells()));
  std::vector<WeightedSum> sums(n_regions);
  for (Cell cell = 0; cell < coarse.n_cells(); ++cell) {
    if (labels[cell] == kNoLabel) continue;
    sums[labels[cell]].add(coarse.positions[cell], coarse.measures[cell]);
  }
  std::vector<Point> means;
  means.reserve(sums.size());
  for (const WeightedSum& sum : sums) means.push_back(sum.mean());
  return means;
}

}  // namespace

// The coarse cells of one range, and the arcs that leave them.
struct CoarseGraph::Part {
  RangeCells cells;
  RangeArcs leaving;
};

CoarseGraph::CoarseGraph(const OrderedGraph& fine, Place cell_size, ThreadTeam& team)
    : fine_(fine), local_(fine.n_cells()) {
  SUPERFACETS_ASSERT(fine.is_symmetric && cell_size >= 1);
  // (N,) `length` of each fine cell, as defined at divide_range
  Buffer<float> lengths(fine.n_cells());
  std::vector<Part> parts = divide(cell_size, lengths, team);
  number(parts);
  Buffer<Point> positions(centers_.size());
  Buffer<double> measures(centers_.size());
  measure(parts, positions, measures, team);
  const bool is_straight = fine.straight_unit > 0.0;
  const CrossingLengths crossing{fine, lengths.span(),
                                 is_straight ? positions.span() : std::span<const Point>()};
  team.for_each(std::ssize(parts),
                [&](std::int64_t range, int) { connect(range, crossing, parts[range]); });
  lengths = {};  // returns memory that `joined` takes
  graph_ = joined(parts, PlacedCells(std::move(positions), std::move(measures), team), team);
  graph_.crease_limit = fine.crease_limit;
}

std::pair<Place, Place> CoarseGraph::places(std::int64_t range) const {
  const std::int64_t begin = range << kRangeBits;
  const std::int64_t end = std::min<std::int64_t>(begin + (1 << kRangeBits), fine_.n_cells());
  return {static_cast<Place>(begin), static_cast<Place>(end)};
}

std::vector<CoarseGraph::Part> CoarseGraph::divide(Place cell_size, Buffer<float>& lengths,
                                                   ThreadTeam& team) {
  std::vector<Part> parts(((fine_.n_cells() - 1) >> kRangeBits) + 1);
  PerThread<CellGrower> growers(team.size());
  team.for_each(std::ssize(parts), [&](std::int64_t range, int thread) {
    const auto [begin, end] = places(range);
    const auto write = [&](Place place, std::size_t cell, float length) {
      local_[place] = static_cast<LocalCell>(cell);
      lengths[place] = length;
    };
    parts[range].cells =
        divide_range(fine_, growers.get(thread, fine_, cell_size), begin, end, write);
  });
  return parts;
}

void CoarseGraph::number(std::span<const Part> parts) {
  for (const Part& part : parts) {
    first_cells_.push_back(static_cast<Cell>(centers_.size()));
    centers_.insert(centers_.end(), part.cells.centers.begin(), part.cells.centers.end());
  }
}

void CoarseGraph::measure(std::span<Part> parts, Buffer<Point>& positions, Buffer<double>& measures,
                          ThreadTeam& team) const {
  team.for_each(std::ssize(parts), [&](std::int64_t range, int) {
    Cell cell = first_cells_[range];
    for (const WeightedSum& sum : std::exchange(parts[range].cells.sums, {})) {
      positions[cell] = sum.mean();
      measures[cell++] = sum.measure;
    }
  });
}

void CoarseGraph::connect(std::int64_t range, const CrossingLengths& lengths, Part& part) const {
  const auto coarse_of = [this](Place place) { return this->coarse_of(place); };
  part.leaving = connect_range(places(range), {first_cells_[range], part.cells.centers.size()},
                               coarse_of, lengths);
}

OrderedGraph CoarseGraph::joined(std::span<const Part> parts, PlacedCells cells,
                                 ThreadTeam& team) const {
  std::vector<std::int64_t> first_arcs{0};
  for (const Part& part : parts)
    first_arcs.push_back(first_arcs.back() + std::ssize(part.leaving.arcs));
  Buffer<std::int64_t> offsets(centers_.size() + 1);
  Buffer<Arc> arcs(first_arcs.back());
  offsets[0] = 0;
  team.for_each(std::ssize(parts), [&](std::int64_t range, int) {
    const Part& part = parts[range];
    std::copy(part.leaving.arcs.begin(), part.leaving.arcs.end(), arcs.begin() + first_arcs[range]);
    for (std::size_t i = 0; i < part.cells.centers.size(); ++i) {
      const Cell cell = first_cells_[range] + static_cast<Cell>(i);
      offsets[cell + 1] = first_arcs[range] + part.leaving.ends[i];
    }
  });
  return {std::move(cells), std::move(offsets), std::move(arcs), fine_.straight_unit};
}

Buffer<Cell> CoarseGraph::coarse_cells(std::span<const Cell> groups, ThreadTeam& team) const {
  SUPERFACETS_ASSERT(groups.empty() || std::cmp_equal(groups.size(), graph_.n_cells()));
  Buffer<Cell> coarse(fine_.n_cells());
  team.for_each_index(fine_.n_cells(), [&](std::int64_t cell) {
    const Cell found = coarse_of(fine_.place_of(cell));
    coarse[cell] = groups.empty() ? found : groups[found];
  });
  return coarse;
}

void CoarseGraph::set_lengths(std::span<const float> lengths, ThreadTeam& team) {
  SUPERFACETS_ASSERT(lengths.size() == graph_.arcs.size());
  team.for_each_index(std::ssize(lengths),
                      [&](std::int64_t arc) { graph_.arcs[arc].length = lengths[arc]; });
}

Buffer<float> CoarseGraph::means_of(const PartVectors& vectors, ThreadTeam& team) const {
  const std::size_t width = vectors.width;
  Buffer<float> means(width * centers_.size());
  team.for_each(n_ranges(), [&](std::int64_t range, int) {
    const auto [first, last] = cells_of(range);
    std::vector<double> sums(width * (last - first), 0.0);
    std::vector<double> weights(last - first, 0.0);
    for (auto [place, end] = places(range); place < end; ++place) {
      const Cell cell = coarse_of(place) - first;
      const double weight = std::max(fine_.measures[place], kMinMeasure);
      weights[cell] += weight;
      const float* row = vectors.rows.data() + width * vectors.group_of(fine_.cell_at(place));
      for (std::size_t i = 0; i < width; ++i) sums[width * cell + i] += weight * double{row[i]};
    }
    for (Cell cell = first; cell < last; ++cell) {
      for (std::size_t i = 0; i < width; ++i) {
        const double sum = sums[width * (cell - first) + i];
        means[width * cell + i] = static_cast<float>(sum / weights[cell - first]);
      }
    }
  });
  return means;
}

SpreadPaths CoarseGraph::spread(std::span<const PathLength> lengths, std::span<const Label> labels,
                                std::span<const Cell> centers, bool needs_lengths,
                                ThreadTeam& team) {
  SUPERFACETS_ASSERT(std::cmp_equal(labels.size(), graph_.n_cells()));
  SUPERFACETS_ASSERT(lengths.size() == labels.size());
  if (!needs_lengths) {
    graph_ = OrderedGraph();
    local_ = {};
  }
  Expansion expansion(fine_, team);
  const std::vector<Place> places = fine_.places_of(centers);
  for (std::size_t label = 0; label < places.size(); ++label) {
    expansion.start(places[label], static_cast<Label>(label));
  }
  for (std::size_t cell = 0; cell < labels.size(); ++cell) {
    if (labels[cell] == kNoLabel) continue;
    expansion.propose(centers_[cell], {lengths[cell], labels[cell]});
  }
  expansion.run();
  SpreadPaths paths;
  if (needs_lengths) {
    paths.lengths = Buffer<PathLength>(fine_.n_cells());
    team.for_each_index(fine_.n_cells(), [&](Cell cell) {
      paths.lengths[cell] = expansion.path(fine_.place_of(cell)).length;
    });
  }
  const Buffer<Label> by_place = std::move(expansion).take_paths().labels;
  paths.labels = Buffer<Label>(fine_.n_cells());
  team.for_each_index(fine_.n_cells(),
                      [&](Cell cell) { paths.labels[cell] = by_place[fine_.place_of(cell)]; });
  return paths;
}

std::vector<Cell> CoarseGraph::refine(std::span<const Label> labels, std::span<const Cell> centers,
                                      ThreadTeam& team) const {
  const std::vector<Point> means = region_means(graph_, labels, std::ssize(centers));
  std::vector<Label> regions(centers.size());
  std::iota(regions.begin(), regions.end(), Label{0});
  std::vector<Place> places;
  places.reserve(centers.size());
  for (const Cell center : centers) places.push_back(centers_[center]);
  const auto label_of = [&](Place place) { return labels[coarse_of(place)]; };
  find_nearest_members(fine_, regions, means, label_of, places, team);
  return fine_.cells_at(places);
}

}  // namespace superfacets
