#include "regions/stiffness.hpp"

#include "base/lists.hpp"

namespace superfacets {
namespace {

// Lower bound of A_0 in the stiffness cost, as a fraction of the mean area of a region. Without a
// bound, a region with area 0 would be infinitely stiff.
constexpr double kMinFraction = 1e-6;

// Sums over a run of consecutive cells with the same label.
struct Run {
  Label region;
  double area = 0.0;            // sum of areas
  Point moment{0.0, 0.0, 0.0};  // sum of area times position
};

}  // namespace

RegionSums sums_of_regions(const Surface& surface, std::span<const Label> labels,
                           ThreadTeam& team) {
  if (labels.empty()) return {};
  const auto append = [&](Cell cell, std::vector<Run>& runs) {
    if (runs.empty() || runs.back().region != labels[cell]) runs.push_back({labels[cell]});
    const double area = surface.measure(cell);
    runs.back().area += area;
    runs.back().moment = runs.back().moment + area * surface.position(cell);
  };
  const Label n_regions = *std::ranges::max_element(labels) + 1;
  RegionSums sums{std::vector<double>(n_regions, 0.0),
                  std::vector<Point>(n_regions, Point{0.0, 0.0, 0.0})};
  for (const Run& run : gather<Run>(surface.n_cells(), append, team)) {
    sums.areas[run.region] += run.area;
    sums.moments[run.region] = sums.moments[run.region] + run.moment;
  }
  return sums;
}

Stiffness::Stiffness(const Surface& surface, const RegionSums& at_first,
                     std::span<const Label> labels, const StiffnessOptions& options)
    : surface_(surface), roundness_(options.roundness), sizes_(options.sizes) {
  SUPERFACETS_ASSERT(options.stiffness >= 0.0 && options.roundness >= 0.0);
  SUPERFACETS_ASSERT(at_first.moments.size() == at_first.areas.size());
  if (options.stiffness == 0.0) return;
  double total = 0.0;
  for (const double area : at_first.areas) total += area;
  if (!(total > 0.0)) return;
  const std::size_t n_regions = at_first.areas.size();
  const double mean = total / static_cast<double>(n_regions);
  changes_.assign(n_regions, 0.0);
  for (std::size_t region = 0; region < n_regions; ++region) {
    const double area = std::max(at_first.areas[region], kMinFraction * mean);
    weights_.push_back(options.stiffness * mean / area / area);
    centroids_.push_back((1.0 / area) * at_first.moments[region]);
  }
  if (!options.goals.empty()) set_goals(labels, options, kMinFraction * mean);
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
