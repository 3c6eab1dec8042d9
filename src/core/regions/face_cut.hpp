// Stage 5: how borders of regions run through one face.
#pragma once

#include <algorithm>
#include <array>

#include "base/types.hpp"

namespace superfacets {

// The parts of a face that belong to each label, as fractions of its area; unused entries have
// kNoLabel.
struct FaceShares {
  Label labels[3] = {kNoLabel, kNoLabel, kNoLabel};
  float shares[3] = {0.0F, 0.0F, 0.0F};
};

// The cut of a face by the labels of its corners. A corner with kNoLabel lies on a border. Side s
// joins corners s and s + 1, and is cut if both have labels, and different ones:
// - no side: the face is whole;
// - one: from its crossing to the third corner, which lies on a border;
// - two: from crossing to crossing;
// - three: from a junction to each crossing.
struct FaceCut {
  Label labels[3];      // of the corners
  double crossings[3];  // of side s, as a fraction of the way from corner s to corner s + 1
  Label whole;          // of the face, if no side is cut
  int n_cuts = 0;

  bool is_cut(int side) const {
    const Label a = labels[side];
    const Label b = labels[next_corner(side)];
    return a != kNoLabel && b != kNoLabel && a != b;
  }

  int n_parts() const {
    constexpr int kParts[] = {1, 2, 3, 6};
    return kParts[n_cuts];
  }

  // The first side that is cut, or is not.
  int side_where(bool cut) const {
    int side = 0;
    while (side < 2 && is_cut(side) != cut) ++side;
    return side;
  }

  // The junction of three cuts, as weights of the corners: the mean of the crossings, or the
  // nearest point to it on the way to the centroid that is no nearer to a side than kLeastWeight.
  std::array<double, 3> junction() const {
    std::array<double, 3> weights;
    double shift = 0.0;
    for (int corner = 0; corner < 3; ++corner) {
      double& weight = weights[corner];
      weight = (1.0 - crossings[corner] + crossings[previous_corner(corner)]) / 3.0;
      if (weight < kLeastWeight) {
        shift = std::max(shift, (kLeastWeight - weight) / (1.0 / 3.0 - weight));
      }
    }
    for (double& weight : weights) weight += shift * (1.0 / 3.0 - weight);
    return weights;
  }

  FaceShares shares() const {
    if (n_cuts == 0) return {{whole, kNoLabel, kNoLabel}, {1.0F, 0.0F, 0.0F}};
    if (n_cuts == 1) return shares_of_two_parts();
    return n_cuts == 2 ? shares_of_corner() : shares_of_three();
  }

 private:
  // With less, angles of parts are smaller than where two sides are cut.
  static constexpr double kLeastWeight = 0.15;

  FaceShares shares_of_two_parts() const {
    const int side = side_where(true);
    const auto share = static_cast<float>(crossings[side]);
    return {{labels[side], labels[next_corner(side)], kNoLabel}, {share, 1.0F - share, 0.0F}};
  }
  FaceShares shares_of_corner() const {
    const int uncut = side_where(false);
    const int odd = previous_corner(uncut);
    const auto share = static_cast<float>(crossings[odd] * (1.0 - crossings[next_corner(uncut)]));
    return {{labels[odd], labels[uncut], kNoLabel}, {share, 1.0F - share, 0.0F}};
  }
  // In coordinates with the two sides at a corner as axes, twice the areas of triangles.
  FaceShares shares_of_three() const {
    FaceShares found;
    const std::array<double, 3> middle = junction();
    for (int corner = 0; corner < 3; ++corner) {
      const double along = crossings[corner];
      const double beside = 1.0 - crossings[previous_corner(corner)];
      found.labels[corner] = labels[corner];
      found.shares[corner] = static_cast<float>(along * middle[previous_corner(corner)] +
                                                middle[next_corner(corner)] * beside);
    }
    return found;
  }
};

}  // namespace superfacets
