// Stage 5: borders of regions as smooth curves, from labels that diffuse over vertices.
#pragma once

#include <vector>

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"
#include "regions/face_cut.hpp"
#include "regions/labeled_mesh.hpp"

namespace superfacets {

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
