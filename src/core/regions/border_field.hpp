// Stage 5: computes smooth borders of regions, which may cross faces, by diffusing labels over
// vertices.
#pragma once

#include <array>

#include "regions/labeled_mesh.hpp"

namespace superfacets {

// Up to three labels of a face, each with its fraction of the area. Unused entries have kNoLabel.
struct FaceFractions {
  Label labels[3] = {kNoLabel, kNoLabel, kNoLabel};
  float fractions[3] = {0.0F, 0.0F, 0.0F};
};

// How a face is cut, depending on the labels of its corners. A corner with kNoLabel lies on a
// border. Side s joins corners s and s + 1, and is cut if its corners have two different labels. A
// face without cut sides remains whole. If one side is cut, the cut runs from the crossing on this
// side to the opposite corner, which lies on a border. If two sides are cut, the cut runs from
// crossing to crossing. If three sides are cut, three cuts run from a junction inside the face to
// the crossings.
struct FaceCut {
  Label labels[3];  // label of each corner
  double
      crossings[3];  // [s] position of the cut on side s, from 0 at corner s to 1 at corner s + 1
  Label whole;       // label of the face if no side is cut
  int n_cuts = 0;    // number of cut sides

  bool is_cut(int side) const {
    const Label a = labels[side];
    const Label b = labels[next_corner(side)];
    return a != kNoLabel && b != kNoLabel && a != b;
  }

  int n_parts() const {
    constexpr int kParts[] = {1, 2, 3, 6};
    return kParts[n_cuts];
  }

  // The lowest side for which is_cut(side) == cut.
  int side_where(bool cut) const {
    int side = 0;
    while (side < 2 && is_cut(side) != cut) ++side;
    return side;
  }

  // Barycentric coordinates of the junction of three cuts: the mean of the crossings, moved toward
  // the centroid until every coordinate is at least kMinWeight.
  std::array<double, 3> junction() const {
    std::array<double, 3> weights;
    double shift = 0.0;
    for (int corner = 0; corner < 3; ++corner) {
      double& weight = weights[corner];
      weight = (1.0 - crossings[corner] + crossings[previous_corner(corner)]) / 3.0;
      if (weight < kMinWeight) {
        shift = std::max(shift, (kMinWeight - weight) / (1.0 / 3.0 - weight));
      }
    }
    for (double& weight : weights) weight += shift * (1.0 / 3.0 - weight);
    return weights;
  }

  FaceFractions fractions() const {
    if (n_cuts == 0) return {{whole, kNoLabel, kNoLabel}, {1.0F, 0.0F, 0.0F}};
    if (n_cuts == 1) return fractions_of_two_parts();
    return n_cuts == 2 ? fractions_of_corner() : fractions_of_three();
  }

 private:
  // Minimum barycentric coordinate of a junction. With a smaller minimum, the six parts could have
  // smaller angles than the parts of faces with two cut sides.
  static constexpr double kMinWeight = 0.15;

  FaceFractions fractions_of_two_parts() const {
    const int side = side_where(true);
    const auto fraction = static_cast<float>(crossings[side]);
    return {{labels[side], labels[next_corner(side)], kNoLabel}, {fraction, 1.0F - fraction, 0.0F}};
  }
  FaceFractions fractions_of_corner() const {
    const int uncut = side_where(false);
    const int odd = previous_corner(uncut);
    const auto fraction =
        static_cast<float>(crossings[odd] * (1.0 - crossings[next_corner(uncut)]));
    return {{labels[odd], labels[uncut], kNoLabel}, {fraction, 1.0F - fraction, 0.0F}};
  }
  // The part at each corner is a quadrilateral. The quadrilateral is the sum of two triangles,
  // whose areas are computed from barycentric coordinates.
  FaceFractions fractions_of_three() const {
    FaceFractions found;
    const std::array<double, 3> middle = junction();
    for (int corner = 0; corner < 3; ++corner) {
      const double along = crossings[corner];
      const double beside = 1.0 - crossings[previous_corner(corner)];
      found.labels[corner] = labels[corner];
      found.fractions[corner] = static_cast<float>(along * middle[previous_corner(corner)] +
                                                   middle[next_corner(corner)] * beside);
    }
    return found;
  }
};

struct CutOptions {
  int n_rounds = 1;    // number of rounds; borders move once per round
  int n_steps = 1;     // number of diffusion steps per round
  int n_balances = 0;  // number of corrections per round that restore the areas of regions
  // minimum distance of a crossing from the ends of its edge, as a fraction of the edge length
  double margin = 0.1;
};

// Up to kMost labels at a vertex, with their fractions in descending order. The fractions sum to 1.
// Unused entries have kNoLabel.
struct LabelMix {
  static constexpr int kMost = 4;
  Label labels[kMost] = {kNoLabel, kNoLabel, kNoLabel, kNoLabel};
  float fractions[kMost] = {0.0F, 0.0F, 0.0F, 0.0F};

  bool is_pure() const { return labels[1] == kNoLabel; }
  float fraction(Label label) const {
    for (int i = 0; i < kMost; ++i) {
      if (labels[i] == label) return fractions[i];
    }
    return 0.0F;
  }
};

// Threshold dynamics (Merriman, Bence and Osher, 1992) for many labels with given areas. Each
// vertex has a fraction of each label nearby. A round consists of three operations. First, the
// fractions at a vertex are set to the area-weighted mean of its faces. Second, the fractions
// diffuse along edges. Third, each vertex gets the label with the largest fraction, and a border
// crosses an edge where the interpolated fractions of two labels are equal. The three operations
// shorten borders. An offset per label, which is added to its fractions, restores the initial area
// of the region.
//
// Labels diffuse only within a few rings of vertices around borders, and never into or through
// pinned vertices (see pinned_vertices). The result does not depend on the number of threads. Time
// O(F), plus O(faces near borders) per step.
class BorderField {
 public:
  BorderField(const LabeledMesh& mesh, const FacesAround& around, const CutOptions& options,
              ThreadTeam& team);

  void run();

  FaceCut cut_of(Face face) const;

  // Position of the crossing on the edge between two welded vertices with different labels, from 0
  // at a to 1 at b.
  double crossing(Vertex a, Vertex b) const;

 private:
  void mix_labels();
  void find_near();
  void find_near_faces(std::span<const std::uint8_t> rings);
  void diffuse();
  void balance();
  void cut();
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
  Buffer<std::uint8_t> are_pinned_;  // (V,) 1 if the border does not move at this vertex
  Buffer<float> cotangents_;         // (3 F,) clamped cotangent of the angle at each corner
  Buffer<FaceFractions> fractions_;  // (F,) label fractions of each face after the latest cut
  Buffer<LabelMix> mixes_;           // (V,) label fractions at each vertex
  // Label fractions of the vertices in near_ after one diffusion step.
  Buffer<LabelMix> next_mixes_;
  Buffer<Label> chosen_;           // (V,) label of each vertex; kNoLabel if it is on a border
  std::vector<Vertex> near_;       // vertices near a border that are not pinned, ascending
  std::vector<Face> near_faces_;   // faces with a corner near a border
  std::vector<double> far_areas_;  // (n_labels,) area of each label in faces outside near_faces_
  std::vector<double> goals_;      // (n_labels,) initial area of each label
  std::vector<double> steps_;      // (n_labels,) change of the offset per relative area error
  std::vector<double> offsets_;    // (n_labels,) number added to the fractions of each label
};

}  // namespace superfacets
