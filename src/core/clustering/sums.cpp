#include "clustering/sums.hpp"

namespace superfacets {
namespace {

constexpr double kLowerScale = 0x1p31;

// Upper bound of the sum over all cells, after scaling.
constexpr double kLargest = 0x1p62;

// Smallest total for which the scale is finite. The caller rejects meshes with smaller areas or
// extents. Only nearly coincident centroids can have a smaller extent, and then any center is
// acceptable.
constexpr double kSmallestTotal = 0x1p-900;

// Returns the power of two that scales the sum `total` to less than 2^61. The margin to kLargest
// allows for rounding errors.
double scale_for(double total) {
  return total > kSmallestTotal ? std::ldexp(1.0, 60 - std::ilogb(total)) : 1.0;
}

}  // namespace

FixedPoint::FixedPoint(const PlacedCells& cells)
    : cells_(cells), measure_scale_(scale_for(cells.total_measure)) {
  const Point extent = cells.bounds.high - cells.bounds.low;
  position_scale_ = scale_for(cells.total_measure * std::max({extent.x, extent.y, extent.z}));
}

FixedSum FixedPoint::of(Place place) const {
  const double measure = cells_.measures[place];
  const Point moment = measure * (cells_.positions[place] - cells_.bounds.low);
  const std::array<double, 4> scaled{position_scale_ * moment.x, position_scale_ * moment.y,
                                     position_scale_ * moment.z, measure_scale_ * measure};
  FixedSum sum;
  for (int i = 0; i < 4; ++i) {
    SUPERFACETS_ASSERT(scaled[i] >= 0.0 && scaled[i] < kLargest);
    sum.upper[i] = std::llrint(scaled[i]);
    sum.lower[i] = std::llrint((scaled[i] - static_cast<double>(sum.upper[i])) * kLowerScale);
  }
  return sum;
}

Point FixedPoint::mean(const FixedSum& sum) const {
  std::array<double, 4> total{};
  for (int i = 0; i < 4; ++i) {
    total[i] = static_cast<double>(sum.upper[i]) + static_cast<double>(sum.lower[i]) / kLowerScale;
  }
  const double to_mean = measure_scale_ / position_scale_ / total[3];
  return cells_.bounds.low + Point{total[0] * to_mean, total[1] * to_mean, total[2] * to_mean};
}

}  // namespace superfacets
