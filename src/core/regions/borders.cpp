#include "regions/borders.hpp"

#include "base/elementary.hpp"
#include "base/lists.hpp"

namespace superfacets {
namespace {

struct Crossing {
  Label low;
  Label high;
  std::int64_t arc;
  double cost;
};

struct RegionLength {
  Label region;
  double length;
};

// Appends the lengths of the sides of a cell that are part of the perimeter of the cell's region:
// the open part of its border, and sides at which another cell is in another region. If several
// cells of the region meet at a side, its length is counted at the lowest cell only.
void append_border(const Surface& surface, std::span<const Label> labels, Cell cell,
                   std::vector<RegionLength>& lengths) {
  const Label own = labels[cell];
  const double open = surface.open_length(cell);
  if (open > 0.0) lengths.push_back({own, open});
  surface.for_each_side(cell, [&](std::int64_t begin, std::int64_t end) {
    const auto neighbors = surface.arcs().targets.subspan(begin, end - begin);
    const bool is_border =
        std::ranges::any_of(neighbors, [&](Cell other) { return labels[other] != own; });
    const bool is_counted = std::ranges::any_of(
        neighbors, [&](Cell other) { return other < cell && labels[other] == own; });
    if (is_border && !is_counted) lengths.push_back({own, surface.border_length(cell, begin)});
  });
}

}  // namespace

void BorderCosts::write(const Surface& surface, Cell from, std::int64_t arc,
                        std::span<float> costs) const {
  constexpr std::size_t kAtOnce = 4;  // number of arcs whose exponentials are computed together
  std::array<CrossedBorder, kAtOnce> crossed;
  std::array<double, kAtOnce> powers;
  while (!costs.empty()) {
    const std::size_t n = std::min(kAtOnce, costs.size());
    surface.write_crossed(from, arc, std::span(crossed).first(n));
    for (std::size_t i = 0; i < n; ++i, ++arc) {
      const double excess = length(arc) - crossed[i].step_length;
      powers[i] = -std::max(0.0, excess) / crease_scale;
    }
    exponentials(std::span(powers).first(n), std::span(powers).first(n));
    for (std::size_t i = 0; i < n; ++i) {
      costs[i] = static_cast<float>(crossed[i].border_length * powers[i]);
    }
    costs = costs.subspan(n);
  }
}

double BorderCosts::operator()(const Surface& surface, Cell from, std::int64_t arc) const {
  const double excess = std::max(0.0, length(arc) - surface.step_length(from, arc));
  return surface.border_length(from, arc) * exponential(-excess / crease_scale);
}

std::vector<RegionBorder> region_borders(const Surface& surface, const BorderCosts& costs,
                                         std::span<const Label> labels, ThreadTeam& team) {
  SUPERFACETS_ASSERT(std::cmp_equal(labels.size(), surface.n_cells()));
  SUPERFACETS_ASSERT(std::ssize(costs.lengths) == surface.arcs().n_arcs() &&
                     costs.crease_scale > 0.0);
  const auto add_crossings = [&](Cell cell, std::vector<Crossing>& found) {
    for (const auto [arc, neighbor] : surface.arcs().steps(cell)) {
      const Label other = labels[neighbor];
      if (labels[cell] >= other) continue;
      found.push_back({labels[cell], other, arc, costs(surface, cell, arc)});
    }
  };
  Buffer<Crossing> crossings = gather<Crossing>(surface.n_cells(), add_crossings, team);
  sort_crossings(crossings);
  std::vector<RegionBorder> borders;
  for (const Crossing& crossing : crossings) {
    const bool is_new = borders.empty() || borders.back().low != crossing.low ||
                        borders.back().high != crossing.high;
    if (is_new) borders.push_back({crossing.low, crossing.high, 0.0});
    borders.back().cost += crossing.cost;
  }
  return borders;
}

std::vector<double> region_perimeters(const Surface& surface, std::span<const Label> labels,
                                      Label n_regions, ThreadTeam& team) {
  SUPERFACETS_ASSERT(std::cmp_equal(labels.size(), surface.n_cells()));
  const auto add_lengths = [&](Cell cell, std::vector<RegionLength>& lengths) {
    if (labels[cell] != kNoLabel) append_border(surface, labels, cell, lengths);
  };
  std::vector<double> perimeters(n_regions, 0.0);
  for (const auto& [region, length] : gather<RegionLength>(surface.n_cells(), add_lengths, team)) {
    perimeters[region] += length;
  }
  return perimeters;
}

}  // namespace superfacets
