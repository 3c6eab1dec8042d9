// Measure-weighted sums over cells, exact in whatever order cells come and go.
#pragma once

#include <array>

#include "base/types.hpp"
#include "cells/ordered_graph.hpp"

namespace superfacets {

// What one cell, or some cells, add to a sum: fixed-point numbers in two parts, the lower of which
// counts 2^-31 of what the upper counts. Sums of integers do not depend on their order, so cells
// can be added by several threads, and taken away again, without a trace.
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

// Turns cells into fixed-point numbers and sums of them into means. All cells together are some
// 2^60 to 2^61 in the upper part; what rounding takes from a cell is below 2^-92 of all.
class FixedPoint {
 public:
  explicit FixedPoint(const OrderedGraph& graph);

  FixedSum of(const OrderedGraph& graph, Place place) const;

  // Whether a region has too little of the total measure for a mean of double precision (2^-40 or
  // less): only then must its cells be summed in another way.
  static bool is_too_small(const FixedSum& sum) { return sum.upper[3] < (std::int64_t{1} << 20); }

  Point mean(const FixedSum& sum) const;

 private:
  Point origin_;
  double measure_scale_;   // powers of two
  double position_scale_;  // of measure times position
};

}  // namespace superfacets
