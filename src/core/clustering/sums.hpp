// Measure-weighted sums over cells. WeightedSum uses floating point, and is used for few cells.
// FixedSum uses fixed point, so its result does not depend on the order of additions and
// subtractions.
#pragma once

#include "cells/ordered_graph.hpp"

namespace superfacets {

// Floating-point sum over cells. Cells must be added in an order that does not depend on the number
// of threads.
struct WeightedSum {
  Point weighted{0.0, 0.0, 0.0};  // sum of measure times position
  Point plain{0.0, 0.0, 0.0};     // sum of positions
  double measure = 0.0;           // sum of measures
  double count = 0.0;             // number of cells

  void add(Point position, double cell_measure) {
    weighted = weighted + cell_measure * position;
    plain = plain + position;
    measure += cell_measure;
    count += 1.0;
  }

  // The weighted mean of the positions, or the unweighted mean if all measures are 0.
  Point mean() const {
    const Point sum = measure > 0.0 ? weighted : plain;
    const double weight = measure > 0.0 ? measure : count;
    return {sum.x / weight, sum.y / weight, sum.z / weight};
  }
};

// Fixed-point sum over cells. Each number has an upper and a lower part; a unit of the lower part
// is 2^-31 units of the upper part. Sums of integers have no rounding errors, so several threads
// can add and subtract cells in any order.
struct FixedSum {
  // Four numbers: measure times x, y and z (relative to the lower corner of the bounding box), and
  // the measure.
  std::array<std::int64_t, 4> upper{};
  std::array<std::int64_t, 4> lower{};

  void add(const FixedSum& other) {
    for (int i = 0; i < 4; ++i) {
      upper[i] += other.upper[i];
      lower[i] += other.lower[i];
    }
  }
};

// Converts cells to fixed-point numbers, and sums of these numbers to means. The upper part of the
// sum over all cells is about 2^60 to 2^61. The rounding error per cell is below 2^-92 of that sum.
class FixedPoint {
 public:
  explicit FixedPoint(const PlacedCells& cells);

  FixedSum of(Place place) const;

  // Whether a region has at most 2^-40 of the total measure: too little for an accurate mean in
  // fixed point. The cells of such a region must be summed in floating point.
  static bool is_too_small(const FixedSum& sum) { return sum.upper[3] < (std::int64_t{1} << 20); }

  Point mean(const FixedSum& sum) const;

 private:
  const PlacedCells& cells_;
  double measure_scale_;   // factor of measures, a power of two
  double position_scale_;  // factor of (measure times position), a power of two
};

}  // namespace superfacets
