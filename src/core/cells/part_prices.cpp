#include "cells/part_prices.hpp"

#include "base/elementary.hpp"

namespace superfacets {
namespace {

// Distance of two rows. A width known at compile time doubles the speed; with kWidth = 0, any_width
// is the width.
template <std::size_t kWidth, typename Number>
double distance_in(std::span<const Number> rows, std::size_t any_width, Cell one, Cell other) {
  const std::size_t width = kWidth > 0 ? kWidth : any_width;
  const Number* here = rows.data() + width * one;
  const Number* there = rows.data() + width * other;
  double squared = 0.0;
  for (std::size_t i = 0; i < width; ++i) {
    const double difference = double{here[i]} - double{there[i]};
    squared += difference * difference;
  }
  return std::sqrt(squared);
}

template <typename Number>
double distance_between(std::span<const Number> rows, std::size_t width, Cell one, Cell other) {
  return width == 8 ? distance_in<8>(rows, width, one, other)
                    : distance_in<0>(rows, width, one, other);
}

}  // namespace

double PartVectors::distance(Cell one, Cell other) const {
  return distance_between(rows, width, one, other);
}

float with_price(float length, double factor, double distance) {
  return static_cast<float>(round_to_whole(double{length} + factor * distance));
}

Buffer<float> add_part_prices(const Arcs& arcs, std::span<const float> lengths,
                              std::span<const Cell> group_of, const PartVectors& vectors,
                              double factor, ThreadTeam& team) {
  SUPERFACETS_ASSERT(std::ssize(lengths) == arcs.n_arcs());
  const auto group = [&](Cell cell) { return group_of.empty() ? cell : group_of[cell]; };
  Buffer<float> sums(lengths.size());
  team.for_each_index(arcs.n_cells(), [&](Cell cell) {
    const Cell here = group(cell);
    for (const auto [arc, neighbor] : arcs.steps(cell)) {
      const Cell there = group(neighbor);
      sums[arc] = here == there ? lengths[arc]
                                : with_price(lengths[arc], factor, vectors.distance(here, there));
    }
  });
  return sums;
}

Buffer<double> add_feature_steps(const Arcs& arcs, std::span<const double> given,
                                 std::span<const double> features, std::size_t n_features,
                                 double factor, ThreadTeam& team) {
  SUPERFACETS_ASSERT(std::ssize(given) == arcs.n_arcs());
  SUPERFACETS_ASSERT(std::cmp_equal(features.size(), arcs.n_cells() * n_features));
  Buffer<double> weights(given.size());
  team.for_each_index(arcs.n_cells(), [&](Cell cell) {
    for (const auto [arc, neighbor] : arcs.steps(cell)) {
      weights[arc] = given[arc] + factor * distance_between(features, n_features, cell, neighbor);
    }
  });
  return weights;
}

}  // namespace superfacets
