// Stage 5: areas of regions, which cost something to change.
#pragma once

#include <vector>

#include "base/threads.hpp"
#include "base/types.hpp"
#include "cells/surface.hpp"

namespace superfacets {

struct AreaChange {
  Label region;
  double change;
};

// The decrease of the cost when a cell of this area moves from one region to another.
struct AreaGain {
  double slope = 0.0;
  double curvature = 0.0;
  double of(double area) const { return -area * (slope + curvature * area); }
};

// The cost of changed areas: stiffness / 2 times the sum of (A - A_0)^2 / A_0 over all regions, with
// A_0 the area at first. A larger stiffness (1 / length) keeps areas closer to A_0; with 0 changes
// are free.
class RegionAreas {
 public:
  RegionAreas(const Surface& surface, std::span<const Label> labels, double stiffness,
              ThreadTeam& team);

  bool are_free() const { return weights_.empty(); }
  Label n_regions() const { return static_cast<Label>(weights_.size()); }

  // `changes` holds further changes of all regions, on top of those added.
  AreaGain gain(Label from, Label to, std::span<const double> changes) const {
    return {weights_[to] * (changes_[to] + changes[to]) -
                weights_[from] * (changes_[from] + changes[from]),
            0.5 * (weights_[to] + weights_[from])};
  }

  void add(std::span<const AreaChange> changes) {
    for (const auto [region, change] : changes) changes_[region] += change;
  }

 private:
  std::vector<double> weights_;  // stiffness / A_0; empty if changes are free
  std::vector<double> changes_;  // A - A_0
};

}  // namespace superfacets
