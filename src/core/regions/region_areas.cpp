#include "regions/region_areas.hpp"

#include <algorithm>
#include <numeric>

#include "base/buffer.hpp"

namespace superfacets {
namespace {

// Regions smaller than this fraction of the mean area are as stiff as a region of that size: those
// of area 0 would be infinitely stiff.
constexpr double kLeastShare = 1e-6;

std::vector<double> areas_of(const Surface& surface, std::span<const Label> labels,
                             Label n_regions, ThreadTeam& team) {
  Buffer<double> of_cells(labels.size());
  team.for_each_block(surface.n_cells(), [&](std::int64_t begin, std::int64_t end) {
    for (auto cell = static_cast<Cell>(begin); cell < end; ++cell) {
      of_cells[cell] = surface.measure(cell);
    }
  });
  std::vector<double> areas(n_regions, 0.0);  // the same sums for any number of threads
  for (std::size_t cell = 0; cell < labels.size(); ++cell) areas[labels[cell]] += of_cells[cell];
  return areas;
}

}  // namespace

RegionAreas::RegionAreas(const Surface& surface, std::span<const Label> labels, double stiffness,
                         ThreadTeam& team) {
  if (stiffness == 0.0 || labels.empty()) return;
  const Label n_regions = *std::max_element(labels.begin(), labels.end()) + 1;
  const std::vector<double> areas = areas_of(surface, labels, n_regions, team);
  const double mean = std::accumulate(areas.begin(), areas.end(), 0.0) / n_regions;
  if (!(mean > 0.0)) return;
  changes_.assign(n_regions, 0.0);
  for (const double area : areas) {
    weights_.push_back(stiffness / std::max(area, kLeastShare * mean));
  }
}

}  // namespace superfacets
