#include "clustering/coarsening.hpp"

#include <algorithm>
#include <optional>
#include <tuple>

#include "base/assert.hpp"
#include "base/prefetch.hpp"
#include "clustering/cell_grower.hpp"
#include "clustering/weighted_sum.hpp"

namespace superfacets {
namespace {

// The places of a range, grouped by their coarse cells, ascending within each.
class Members {
 public:
  template <typename CellOf>
  Members(Place begin, Place end, std::size_t n_cells, const CellOf& cell_of)
      : ends_(n_cells, 0), places_(end - begin) {
    for (Place place = begin; place < end; ++place) ++ends_[cell_of(place)];
    Place total = 0;
    for (Place& count : ends_) total += std::exchange(count, total);
    for (Place place = begin; place < end; ++place) places_[ends_[cell_of(place)]++] = place;
  }

  std::span<const Place> of(std::size_t cell) const {
    const Place begin = cell == 0 ? 0 : ends_[cell - 1];
    return std::span(places_).subspan(begin, ends_[cell] - begin);
  }

 private:
  std::vector<Place> ends_;
  std::vector<Place> places_;
};

// Leaves of parallel arcs the shortest, sorted by target.
void remove_parallel(std::vector<Arc>& arcs) {
  std::sort(arcs.begin(), arcs.end(), [](const Arc& a, const Arc& b) {
    return std::tie(a.to, a.length) < std::tie(b.to, b.length);
  });
  const auto end = std::unique(arcs.begin(), arcs.end(),
                               [](const Arc& a, const Arc& b) { return a.to == b.to; });
  arcs.erase(end, arcs.end());
}

}  // namespace

// The coarse cells of a range.
struct CoarseGraph::Part {
  std::vector<Place> centers;
  std::vector<WeightedSum> sums;
  std::vector<std::int64_t> ends;  // of the arcs of each cell
  std::vector<Arc> arcs;
};

CoarseGraph::CoarseGraph(const OrderedGraph& fine, Place cell_size, ThreadTeam& team)
    : fine_(fine), local_(fine.n_cells()) {
  SUPERFACETS_ASSERT(fine.is_symmetric && cell_size >= 1);
  Buffer<float> lengths(fine.n_cells());  // of the path from the center
  std::vector<Part> parts = divide(cell_size, lengths, team);
  number(parts);
  team.for_each(std::ssize(parts),
                [&](std::int64_t range, int) { connect(range, lengths.span(), parts[range]); });
  graph_ = joined(parts, team);
}

std::pair<Place, Place> CoarseGraph::places(std::int64_t range) const {
  const std::int64_t begin = range << kRangeBits;
  const std::int64_t end = std::min<std::int64_t>(begin + (1 << kRangeBits), fine_.n_cells());
  return {static_cast<Place>(begin), static_cast<Place>(end)};
}

std::vector<CoarseGraph::Part> CoarseGraph::divide(Place cell_size, Buffer<float>& lengths,
                                                   ThreadTeam& team) {
  std::vector<Part> parts(((fine_.n_cells() - 1) >> kRangeBits) + 1);
  std::vector<std::optional<CellGrower>> growers(team.size());
  team.for_each(std::ssize(parts), [&](std::int64_t range, int thread) {
    if (!growers[thread]) growers[thread].emplace(fine_, cell_size);
    CellGrower& grower = *growers[thread];
    const auto [begin, end] = places(range);
    grower.divide(begin, end);
    Part& part = parts[range];
    part.centers.assign(grower.centers().begin(), grower.centers().end());
    part.sums.resize(part.centers.size());
    for (Place place = begin; place < end; ++place) {
      local_[place] = static_cast<LocalCell>(grower.cell(place));
      lengths[place] = static_cast<float>(grower.length(place));
      part.sums[grower.cell(place)].add(fine_.positions[place], fine_.measures[place]);
    }
  });
  return parts;
}

void CoarseGraph::number(std::span<const Part> parts) {
  for (const Part& part : parts) {
    first_cells_.push_back(static_cast<Cell>(centers_.size()));
    centers_.insert(centers_.end(), part.centers.begin(), part.centers.end());
  }
}

void CoarseGraph::connect(std::int64_t range, std::span<const float> lengths, Part& part) const {
  const auto [begin, end] = places(range);
  const Members members(begin, end, part.centers.size(),
                        [&](Place place) { return local_[place]; });
  std::vector<Arc> leaving;
  for (std::size_t cell = 0; cell < part.centers.size(); ++cell) {
    const Cell from = first_cells_[range] + static_cast<Cell>(cell);
    leaving.clear();
    for (const Place place : members.of(cell)) {
      if (place + 64 < fine_.n_cells()) prefetch(fine_.arcs_of(place + 64).data());
      for (const Arc& arc : fine_.arcs_of(place)) {
        // The sum of the two paths comes first: the result is the same in both directions.
        leaving.push_back({coarse_of(arc.to), (lengths[place] + lengths[arc.to]) + arc.length});
        if (leaving.back().to == from) leaving.pop_back();
      }
    }
    remove_parallel(leaving);
    part.arcs.insert(part.arcs.end(), leaving.begin(), leaving.end());
    part.ends.push_back(std::ssize(part.arcs));
  }
}

OrderedGraph CoarseGraph::joined(std::span<const Part> parts, ThreadTeam& team) const {
  std::vector<std::int64_t> first_arcs{0};
  for (const Part& part : parts) first_arcs.push_back(first_arcs.back() + std::ssize(part.arcs));
  Buffer<Point> positions(centers_.size());
  Buffer<double> measures(centers_.size());
  Buffer<std::int64_t> offsets(centers_.size() + 1);
  Buffer<Arc> arcs(first_arcs.back());
  offsets[0] = 0;
  team.for_each(std::ssize(parts), [&](std::int64_t range, int) {
    const Part& part = parts[range];
    std::copy(part.arcs.begin(), part.arcs.end(), arcs.begin() + first_arcs[range]);
    for (std::size_t i = 0; i < part.centers.size(); ++i) {
      const Cell cell = first_cells_[range] + static_cast<Cell>(i);
      positions[cell] = part.sums[i].mean();
      measures[cell] = part.sums[i].measure;
      offsets[cell + 1] = first_arcs[range] + part.ends[i];
    }
  });
  PlacedCells cells(std::move(positions), std::move(measures), team);
  return {std::move(cells), std::move(offsets), std::move(arcs)};
}

Buffer<Cell> CoarseGraph::coarse_cells(ThreadTeam& team) const {
  Buffer<Cell> coarse(fine_.n_cells());
  team.for_each_block(fine_.n_cells(), [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t cell = begin; cell < end; ++cell) {
      coarse[cell] = coarse_of(fine_.place_of[cell]);
    }
  });
  return coarse;
}

std::vector<Cell> CoarseGraph::refine(std::span<const Label> labels, std::span<const Cell> centers,
                                      ThreadTeam& team) const {
  SUPERFACETS_ASSERT(std::cmp_equal(labels.size(), graph_.n_cells()));
  std::vector<WeightedSum> sums(centers.size());
  for (Cell cell = 0; cell < graph_.n_cells(); ++cell) {
    if (labels[cell] == kNoLabel) continue;
    sums[labels[cell]].add(graph_.positions[cell], graph_.measures[cell]);
  }
  std::vector<Cell> refined(centers.size());
  team.for_each(std::ssize(centers), [&](std::int64_t label, int) {
    auto is_member = [&](Place place) { return labels[coarse_of(place)] == label; };
    const Place member = centers_[centers[label]];
    refined[label] = fine_.cells[fine_.nearest(sums[label].mean(), member, is_member)];
  });
  return refined;
}

}  // namespace superfacets
