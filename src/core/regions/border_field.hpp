// Stage 5: borders of regions as smooth curves, from labels that diffuse over vertices.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"
#include "regions/labeled_mesh.hpp"

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

struct CutOptions {
  int n_rounds = 1;     // most times that borders move
  int n_steps = 1;      // of diffusion in a round
  int n_balances = 0;   // steps that bring areas back, in a round
  double margin = 0.1;  // least distance of a crossing from both ends of its edge, in its lengths
};

// The labels around a vertex, at most kMost, by descending share. The shares sum to 1.
struct LabelMix {
  static constexpr int kMost = 4;
  Label labels[kMost] = {kNoLabel, kNoLabel, kNoLabel, kNoLabel};
  float shares[kMost] = {0.0F, 0.0F, 0.0F, 0.0F};

  bool is_pure() const { return labels[1] == kNoLabel; }
  float share(Label label) const {
    for (int i = 0; i < kMost; ++i) {
      if (labels[i] == label) return shares[i];
    }
    return 0.0F;
  }
};

// Threshold dynamics (Merriman, Bence and Osher, 1992) for many labels with given areas. In each
// round a vertex gets the shares of the labels in its faces by area; the shares diffuse; each
// vertex gets the label of its largest share, and edges between two labels are crossed where the
// shares of both, interpolated along the edge, are equal. This shortens borders. Offsets of the
// shares, one per label, bring the areas of regions back to those at the beginning.
//
// Shares do not diffuse into or through pinned vertices (see pinned_vertices), nor beyond a few
// rings around borders. The same result for any number of threads. Time O(F) and, for each step, a
// constant time for each face near a border.
class BorderField {
 public:
  BorderField(const LabeledMesh& mesh, const FacesAround& around, const CutOptions& options,
              ThreadTeam& team);

  void run();

  FaceCut cut_of(Face face) const;

  // Position of the crossing on the edge between two welded vertices with different labels, as a
  // fraction of the way from a to b.
  double crossing(Vertex a, Vertex b) const;

 private:
  void mix_labels();
  void find_near();
  void find_near_faces(std::span<const std::uint8_t> rings);
  void diffuse();
  void balance();
  void choose_labels();
  void cut_faces();
  std::vector<double> measure_labels() const;
  LabelMix mix_around(Vertex vertex) const;
  bool is_inside(Vertex vertex) const;
  LabelMix diffused(Vertex vertex) const;
  Label best_label(const LabelMix& mix) const;
  double lead(Vertex vertex, Label own, Label other) const;

  const LabeledMesh& mesh_;
  const FacesAround& around_;
  const CutOptions options_;
  ThreadTeam& team_;
  Buffer<std::uint8_t> are_pinned_;  // (V,)
  Buffer<float> cotangents_;         // (3 F,) of the angle at each corner, within limits
  Buffer<FaceShares> shares_;        // (F,) as of the last cut
  Buffer<LabelMix> mixes_;           // (V,)
  Buffer<LabelMix> next_mixes_;      // of near vertices
  Buffer<Label> chosen_;             // (V,) kNoLabel: the border runs through the vertex
  std::vector<Vertex> near_;         // not pinned, within a few rings of a border; ascending
  std::vector<Face> near_faces_;     // with a corner that is near or pinned
  std::vector<double> far_areas_;    // (n_labels,) of all other faces
  std::vector<double> goals_;        // (n_labels,) areas at the beginning
  std::vector<double> steps_;        // (n_labels,) change of the offset for an area of 0
  std::vector<double> offsets_;      // (n_labels,) added to shares
};

}  // namespace superfacets
