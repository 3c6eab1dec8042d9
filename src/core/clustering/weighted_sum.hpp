// Measure-weighted sums over few cells, in floating point.
#pragma once

#include "base/types.hpp"

namespace superfacets {

// Cells must be added in an order that does not depend on the number of threads.
struct WeightedSum {
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

  // The plain mean where all measures are 0.
  Point mean() const {
    const Point sum = measure > 0.0 ? weighted : plain;
    const double weight = measure > 0.0 ? measure : count;
    return {sum.x / weight, sum.y / weight, sum.z / weight};
  }
};

}  // namespace superfacets
