// Measure-weighted sums over cells: of few cells in floating point, and of all cells in fixed
// point, exact in any order of additions and subtractions.
#pragma once

#include <array>

#include "base/box.hpp"
#include "base/types.hpp"
#include "cells/ordered_graph.hpp"

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

// The contribution of one or more cells to a sum: fixed-point numbers in two parts, where a unit of
// the lower part is 2^-31 of a unit of the upper part. Sums of integers do not depend on their
// order, so several threads can add cells and subtract them again without rounding errors.
struct FixedSum {
  // Measure times x, y and z from the low corner of the bounds, and the measure itself.
  std::array<std::int64_t, 4> upper{};
  std::array<std::int64_t, 4> lower{};

  void add(const FixedSum& other) {
    for (int i = 0; i < 4; ++i) {
      upper[i] += other.upper[i];
      lower[i] += other.lower[i];
    }
  }
};

// Converts cells to fixed-point numbers, and sums of them to means. The upper part of the sum of
// all cells is about 2^60 to 2^61; the rounding error per cell is below 2^-92 of that sum.
class FixedPoint {
 public:
  explicit FixedPoint(const OrderedGraph& graph) : FixedPoint(graph.bounds, graph.total_measure) {}

  // For cells with positions in a box, and measures of this sum.
  FixedPoint(const Box& bounds, double total_measure);

  FixedSum of(const OrderedGraph& graph, Place place) const {
    return of(graph.positions[place], graph.measures[place]);
  }
  FixedSum of(const Point& position, double measure) const;

  // Whether the fraction of a region in the total measure is too small (2^-40 or less) for a mean
  // of double precision. Its cells must then be summed in another way.
  static bool is_too_small(const FixedSum& sum) { return sum.upper[3] < (std::int64_t{1} << 20); }

  Point mean(const FixedSum& sum) const;

 private:
  Point origin_;
  double measure_scale_;   // powers of two
  double position_scale_;  // of measure times position
};

}  // namespace superfacets
