#include "regions/stiffness.hpp"

#include <algorithm>

#include "base/assert.hpp"

namespace superfacets {
namespace {

// Regions smaller than this fraction of the mean area are as stiff as a region of that size: those
// of area 0 would be infinitely stiff.
constexpr double kLeastShare = 1e-6;

// Cells per block of a sum. The sums do not depend on the number of threads.
constexpr std::int64_t kBlock = 1 << 14;

// The sums over consecutive cells of one region.
struct Run {
  Label region;
  double area = 0.0;
  Point moment{0.0, 0.0, 0.0};
};

std::vector<Run> sums_of_regions(const Surface& surface, std::span<const Label> labels,
                                 Label n_regions, ThreadTeam& team) {
  std::vector<std::vector<Run>> blocks((labels.size() + kBlock - 1) / kBlock);
  const auto collect = [&](std::int64_t begin, std::int64_t end) {
    std::vector<Run> runs;
    for (auto cell = static_cast<Cell>(begin); cell < end; ++cell) {
      if (runs.empty() || runs.back().region != labels[cell]) runs.push_back({labels[cell]});
      const double area = surface.measure(cell);
      runs.back().area += area;
      runs.back().moment = runs.back().moment + area * surface.position(cell);
    }
    blocks[begin / kBlock] = std::move(runs);
  };
  team.for_each_block(surface.n_cells(), collect, kBlock);
  std::vector<Run> sums(n_regions);
  for (const std::vector<Run>& runs : blocks) {
    for (const Run& run : runs) {
      sums[run.region].area += run.area;
      sums[run.region].moment = sums[run.region].moment + run.moment;
    }
  }
  return sums;
}

}  // namespace

Stiffness::Stiffness(const Surface& surface, std::span<const Label> labels,
                     const StiffnessOptions& options, ThreadTeam& team)
    : surface_(surface), roundness_(options.roundness), sizes_(options.sizes) {
  SUPERFACETS_ASSERT(options.stiffness >= 0.0 && options.roundness >= 0.0);
  if (options.stiffness == 0.0 || labels.empty()) return;
  const Label n_regions = *std::ranges::max_element(labels) + 1;
  const std::vector<Run> sums = sums_of_regions(surface, labels, n_regions, team);
  double total = 0.0;
  for (const Run& sum : sums) total += sum.area;
  if (!(total > 0.0)) return;
  const double mean = total / n_regions;
  changes_.assign(n_regions, 0.0);
  for (const Run& sum : sums) {
    const double area = std::max(sum.area, kLeastShare * mean);
    weights_.push_back(options.stiffness / area);
    centroids_.push_back((1.0 / area) * sum.moment);
  }
  if (!options.goals.empty()) set_goals(labels, options, kLeastShare * mean);
}

void Stiffness::set_goals(std::span<const Label> labels, const StiffnessOptions& options,
                          double least) {
  SUPERFACETS_ASSERT(sizes_.size() == labels.size() && options.goals.size() == weights_.size());
  for (std::size_t cell = 0; cell < labels.size(); ++cell) changes_[labels[cell]] += sizes_[cell];
  for (std::size_t region = 0; region < weights_.size(); ++region) {
    weights_[region] = options.stiffness / std::max(options.goals[region], least);
    changes_[region] -= options.goals[region];
  }
}

StiffCell Stiffness::cell(Cell cell, Label from, Label to) const {
  const double area = surface_.measure(cell);
  const Point position = surface_.position(cell);
  const double nearer =
      squared_norm(position - centroids_[from]) - squared_norm(position - centroids_[to]);
  return {sizes_.empty() ? area : sizes_[cell], roundness_ * area * nearer};
}

}  // namespace superfacets
