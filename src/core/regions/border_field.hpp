// Stage 5: smooth curves as borders of regions, computed by diffusing labels over vertices.
#pragma once

#include <array>

#include "regions/labeled_mesh.hpp"

namespace superfacets {

// Up to three labels of a face, each with its fraction of the area. Unused entries have kNoLabel.
struct FaceShares {
  Label labels[3] = {kNoLabel, kNoLabel, kNoLabel};
  float shares[3] = {0.0F, 0.0F, 0.0F};
};

// The cut of a face by the labels of its corners. A corner with kNoLabel lies on a border. Side s
// joins corners s and s + 1, and is cut if both corners have labels that differ: - no side: the
// face is whole; - one side: the cut runs from its crossing to the opposite corner, which lies on a
// border; - two sides: the cut runs from crossing to crossing; - three sides: three cuts run from a
// junction to the crossings.
struct FaceCut {
  Label labels[3];      // of the corners
  double crossings[3];  // [s] position of the cut on side s, 0 at corner s to 1 at corner s + 1
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

  // The lowest side whose cut state equals `cut`.
  int side_where(bool cut) const {
    int side = 0;
    while (side < 2 && is_cut(side) != cut) ++side;
    return side;
  }

  // Barycentric coordinates of the junction of three cuts: the mean of the crossings, moved toward
  // the centroid until every coordinate is at least kLeastWeight.
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
  // Minimum barycentric coordinate of a junction. A smaller minimum would give the six parts
  // sharper angles than the parts of faces with two cut sides.
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
  // Uses coordinates whose axes are the two sides at a corner. The terms are twice the areas of
  // triangles.
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
  int n_rounds = 1;    // maximum number of rounds; borders move once per round
  int n_steps = 1;     // diffusion steps per round
  int n_balances = 0;  // steps per round that restore the areas of regions
  // minimum distance of a crossing from either end of its edge, as a fraction of the edge
  double margin = 0.1;
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

// Threshold dynamics (Merriman, Bence and Osher, 1992) for many labels with given areas. A round
// has three steps. First, each vertex gets the area-weighted shares of the labels in its faces.
// Second, the shares diffuse. Third, each vertex takes the label of its largest share, and a border
// crosses an edge between two labels where their interpolated shares are equal. This shortens
// borders. One offset per label, added to its shares, restores the initial area of its region.
//
// Shares diffuse only within a few rings around borders, and never into or through pinned vertices
// (see pinned_vertices). The result does not depend on the number of threads. Time O(F), plus
// O(faces near borders) per step.
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
  Buffer<std::uint8_t> are_pinned_;  // (V,) 1: borders stay at this vertex
  Buffer<float> cotangents_;         // (3 F,) clamped cotangent of the angle at each corner
  Buffer<FaceShares> shares_;        // (F,) shares of each face after the latest cut
  Buffer<LabelMix> mixes_;           // (V,) shares of labels at each vertex
  Buffer<LabelMix> next_mixes_;      // (V,) new shares of near vertices
  Buffer<Label> chosen_;             // (V,) kNoLabel: the border runs through the vertex
  std::vector<Vertex> near_;         // vertices near a border that are not pinned; ascending
  std::vector<Face> near_faces_;     // faces with a corner that is near or pinned
  std::vector<double> far_areas_;    // (n_labels,) area of each label in faces outside near_faces_
  std::vector<double> goals_;        // (n_labels,) initial area of each label
  std::vector<double> steps_;        // (n_labels,) change of the offset for an area of 0
  std::vector<double> offsets_;      // (n_labels,) added to shares
};

}  // namespace superfacets
