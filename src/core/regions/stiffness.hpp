// Stage 5: what it costs regions to change their areas, and to spread out from their centroids.
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

// A cell that may move between two regions, as far as stiffness is concerned.
struct StiffCell {
  double area = 0.0;
  double gain = 0.0;  // of a move, by the distances from both centroids
};

// The decrease of the cost when a cell moves from one region to another.
struct StiffGain {
  double slope = 0.0;
  double curvature = 0.0;
  double of(const StiffCell& cell) const {
    return cell.gain - cell.area * (slope + curvature * cell.area);
  }
};

// The cost is the sum over all regions of
//   stiffness * (A - A_0)^2 / (2 A_0) + roundness * integral of |x - x_0|^2 over the region,
// with A the area of a region, and A_0 and x_0 its area and centroid at first. The first term keeps
// areas. The second prefers round regions where borders of equal length have many shapes, as in a
// regular grid.
struct StiffnessOptions {
  double stiffness = 0.0;  // per unit of length; 0 turns all of it off
  double roundness = 0.0;  // per unit of length, cubed
};

// The area of each region, and the sum of the positions of its cells, weighted by their areas. The
// sums of the cells of each block of consecutive cells are added first, in the order of the cells,
// so that they do not depend on the number of threads.
struct RegionSums {
  std::vector<double> areas;
  std::vector<Point> moments;
};
RegionSums sums_of_regions(const Surface& surface, std::span<const Label> labels, ThreadTeam& team);

class Stiffness {
 public:
  // `at_first` are the sums of all regions; they are not read if stiffness is 0.
  Stiffness(const Surface& surface, const RegionSums& at_first, const StiffnessOptions& options);

  bool is_off() const { return weights_.empty(); }
  Label n_regions() const { return static_cast<Label>(weights_.size()); }

  StiffCell cell(Cell cell, Label from, Label to) const;

  // `changes` holds further changes of all areas, on top of those added.
  StiffGain gain(Label from, Label to, std::span<const double> changes) const {
    return {weights_[to] * (changes_[to] + changes[to]) -
                weights_[from] * (changes_[from] + changes[from]),
            0.5 * (weights_[to] + weights_[from])};
  }

  void add(std::span<const AreaChange> changes) {
    for (const auto [region, change] : changes) changes_[region] += change;
  }

 private:
  const Surface& surface_;
  const double roundness_;
  std::vector<double> weights_;   // stiffness / A_0; empty if it is off
  std::vector<Point> centroids_;  // x_0
  std::vector<double> changes_;   // A - A_0
};

}  // namespace superfacets
