#include "update.hpp"

#include <limits>

namespace superfacets {
namespace {

// Sums over the cells of one region.
struct Sums {
  Point weighted{0.0, 0.0, 0.0};  // of measure times position
  Point plain{0.0, 0.0, 0.0};     // of positions
  double measure = 0.0;
  double count = 0.0;

  void add(Point position, double cell_measure) {
    weighted = weighted + cell_measure * position;
    plain = plain + position;
    measure += cell_measure;
    count += 1.0;
  }

  Point mean() const {
    const Point sum = measure > 0.0 ? weighted : plain;
    const double weight = measure > 0.0 ? measure : count;
    return {sum.x / weight, sum.y / weight, sum.z / weight};
  }
};

}  // namespace

std::vector<Cell> update_centers(std::span<const Point> positions, std::span<const double> measures,
                                 std::span<const Label> labels, Label n_regions) {
  std::vector<Sums> sums(n_regions);
  for (std::size_t cell = 0; cell < positions.size(); ++cell) {
    sums[labels[cell]].add(positions[cell], measures[cell]);
  }
  std::vector<Point> means;
  means.reserve(n_regions);
  for (const Sums& region : sums) means.push_back(region.mean());

  std::vector<Cell> centers(n_regions, 0);
  std::vector<double> nearest_squared(n_regions, std::numeric_limits<double>::infinity());
  for (std::size_t cell = 0; cell < positions.size(); ++cell) {
    const Label label = labels[cell];
    const double squared = squared_norm(positions[cell] - means[label]);
    if (squared >= nearest_squared[label]) continue;
    nearest_squared[label] = squared;
    centers[label] = static_cast<Cell>(cell);
  }
  return centers;
}

Point weighted_mean(std::span<const Point> positions, std::span<const double> measures) {
  Sums sums;
  for (std::size_t cell = 0; cell < positions.size(); ++cell) {
    sums.add(positions[cell], measures[cell]);
  }
  return sums.mean();
}

}  // namespace superfacets
