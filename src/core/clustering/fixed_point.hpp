// Measure-weighted sums over cells, exact in any order of additions and subtractions.
#pragma once

#include <array>

#include "base/box.hpp"
#include "base/types.hpp"
#include "cells/ordered_graph.hpp"

namespace superfacets {

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
