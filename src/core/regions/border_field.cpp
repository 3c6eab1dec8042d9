#include "regions/border_field.hpp"

namespace superfacets {
namespace {

// Diffusion rate: the weight of the neighbors' mean in each step. With a weight of more than one
// half, the label fractions would oscillate.
constexpr float kFlow = 0.5F;

// Smallest label fraction that is kept. Smaller fractions hardly ever become the largest. Without
// this limit, most vertices near a border would store several labels.
constexpr float kMinFraction = 0.02F;

// Limits of the cotangent weights: the cotangents of 87 and 18 degrees. With the lower limit,
// labels diffuse across every edge. With the upper limit, slivers do not dominate their neighbors.
constexpr double kMinCotangent = 0.05;
constexpr double kMaxCotangent = 3.0;

// Number of rings of vertices around borders in which labels diffuse. This number is twice the
// standard deviation of the diffusion kernel after six steps.
constexpr int kRings = 4;

// Change of a region's offset per relative area error. A border moves by (change of the offset) /
// (slope of the label fractions). The slope is estimated as 1 / (0.8 edge lengths times sqrt(number
// of steps)), the length of the border of a region with area A as 4 sqrt(A), and the length of the
// edges of its n faces as 2 sqrt(A / n). The factor 0.5 halves the change, because the two regions
// at a border both correct this border.
constexpr double kBalance = 0.5 / (4.0 * 2.0 * 0.8);
constexpr double kMaxStep = 0.05;   // maximum change of an offset per correction
constexpr double kMaxOffset = 0.6;  // maximum magnitude of an offset

// Maximum number of distinct labels counted around a vertex.
constexpr int kMaxLabels = 32;

// Sums the fractions of each label. Labels are stored in the order of their first appearance.
class MixSum {
 public:
  void add(Label label, float fraction) {
    for (int i = 0; i < n_; ++i) {
      if (labels_[i] == label) {
        fractions_[i] += fraction;
        return;
      }
    }
    if (n_ == kMaxLabels) return;
    labels_[n_] = label;
    fractions_[n_++] = fraction;
  }

  // Adds the fractions of a vertex or a face.
  template <typename Mix>
  void add(const Mix& mix, float weight) {
    for (int i = 0; i < std::ssize(mix.labels) && mix.labels[i] != kNoLabel; ++i) {
      add(mix.labels[i], weight * mix.fractions[i]);
    }
  }

  // Returns the largest fractions in descending order, scaled to a sum of 1. Equal fractions are
  // sorted by label.
  LabelMix largest() {
    float total = 0.0F;
    for (int i = 0; i < n_; ++i) total += fractions_[i];
    LabelMix mix;
    float kept = 0.0F;
    for (int place = 0; place < LabelMix::kMost; ++place) {
      const int best = take_best();
      if (best < 0 || (place > 0 && fractions_[best] < kMinFraction * total)) break;
      mix.labels[place] = labels_[best];
      mix.fractions[place] = fractions_[best];
      kept += fractions_[best];
      labels_[best] = kNoLabel;
    }
    for (float& fraction : mix.fractions) fraction = kept > 0.0F ? fraction / kept : fraction;
    return mix;
  }

 private:
  int take_best() const {
    int best = -1;
    for (int i = 0; i < n_; ++i) {
      if (labels_[i] == kNoLabel) continue;
      if (best < 0 || fractions_[i] > fractions_[best] ||
          (fractions_[i] == fractions_[best] && labels_[i] < labels_[best])) {
        best = i;
      }
    }
    return best;
  }

  int n_ = 0;
  Label labels_[kMaxLabels];
  float fractions_[kMaxLabels];
};

float cotangent(const Point& at, const Point& one, const Point& other) {
  const Point a = one - at;
  const Point b = other - at;
  const double sine = norm(cross(a, b));
  const double cosine = dot(a, b);
  const double ratio = sine > 0.0 ? cosine / sine : 0.0;
  return static_cast<float>(std::clamp(ratio, kMinCotangent, kMaxCotangent));
}

Buffer<float> cotangents_of(const LabeledMesh& mesh, ThreadTeam& team) {
  Buffer<float> cotangents(3 * mesh.faces.size());
  team.for_each_index(std::ssize(mesh.faces), [&](std::int64_t face) {
    const auto& corners = mesh.faces[face].corners;
    for (int i = 0; i < 3; ++i) {
      cotangents[3 * face + i] =
          cotangent(mesh.vertices[corners[i]], mesh.vertices[corners[next_corner(i)]],
                    mesh.vertices[corners[previous_corner(i)]]);
    }
  });
  return cotangents;
}

// Increases the ring numbers of vertices, until each vertex of a face has at least the largest
// number in the face minus one. So each face within n rings of a vertex with the number n gets a
// vertex with a number of at least 1. Time O(F max(rings)).
void spread_rings(const FacesAround& around, std::span<std::uint8_t> rings) {
  // One round per ring number, in descending order. Each round sets the ring numbers that the next
  // round reads.
  for (int ring = rings.empty() ? 0 : *std::ranges::max_element(rings); ring > 1; --ring) {
    const auto less = static_cast<std::uint8_t>(ring - 1);
    for (Face face = 0; face < around.n_faces(); ++face) {
      const auto& [a, b, c] = around.corners(face).corners;
      // larger numbers were processed in an earlier round
      if (int{std::max({rings[a], rings[b], rings[c]})} != ring) continue;
      for (const Vertex corner : {a, b, c}) rings[corner] = std::max(rings[corner], less);
    }
  }
}

}  // namespace

BorderField::BorderField(const LabeledMesh& mesh, const FacesAround& around,
                         const CutOptions& options, ThreadTeam& team)
    : mesh_(mesh),
      around_(around),
      options_(options),
      team_(team),
      are_pinned_(pinned_vertices(mesh, around, team)),
      cotangents_(cotangents_of(mesh, team)),
      fractions_(mesh.faces.size()),
      mixes_(mesh.vertices.size()),
      chosen_(mesh.vertices.size()),
      goals_(mesh.n_labels, 0.0),
      steps_(mesh.n_labels, 0.0),
      offsets_(mesh.n_labels, 0.0) {
  SUPERFACETS_ASSERT(all_below(mesh.labels, mesh.n_labels));
  SUPERFACETS_ASSERT(options.n_rounds > 0 && options.n_steps > 0);
  SUPERFACETS_ASSERT(options.margin > 0.0 && options.margin < 0.5);
  for (std::int64_t face = 0; face < around.n_faces(); ++face) {
    const Label label = mesh.labels[face];
    fractions_[face] = {{label, kNoLabel, kNoLabel}, {1.0F, 0.0F, 0.0F}};
    goals_[label] += around.area(static_cast<Face>(face));
    steps_[label] += 1.0;  // counts faces; the count is converted to a step below
  }
  for (double& step : steps_) step = kBalance * std::sqrt(step / options.n_steps);
}

void BorderField::run() {
  for (int round = 0; round < options_.n_rounds; ++round) {
    mix_labels();
    find_near();
    for (int step = 0; step < options_.n_steps; ++step) diffuse();
    balance();
  }
}

void BorderField::mix_labels() {
  team_.for_each_index(around_.n_vertices(), [&](std::int64_t vertex) {
    mixes_[vertex] = mix_around(static_cast<Vertex>(vertex));
    chosen_[vertex] = are_pinned_[vertex] != 0 ? kNoLabel : mixes_[vertex].labels[0];
  });
}

LabelMix BorderField::mix_around(Vertex vertex) const {
  const std::span<const Face> faces = around_.of(vertex);
  if (faces.empty()) return {};
  const Label first = fractions_[faces[0]].labels[0];
  const auto is_first = [&](Face face) {
    return fractions_[face].labels[0] == first && fractions_[face].labels[1] == kNoLabel;
  };
  if (std::ranges::all_of(faces, is_first)) {
    return {{first, kNoLabel, kNoLabel, kNoLabel}, {1.0F, 0.0F, 0.0F, 0.0F}};
  }
  double area = 0.0;
  for (const Face face : faces) area += around_.area(face);
  MixSum sum;
  for (const Face face : faces) {
    const auto weight = static_cast<float>(area > 0.0 ? around_.area(face) / area : 1.0);
    sum.add(fractions_[face], weight);
  }
  return sum.largest();
}

// Finds the vertices near borders. Ring numbers are kRings at a border, and decrease to 1 in the
// outermost ring.
void BorderField::find_near() {
  Buffer<std::uint8_t> rings(mesh_.vertices.size());
  team_.for_each_index(around_.n_vertices(), [&](std::int64_t vertex) {
    rings[vertex] = !mixes_[vertex].is_pure() || are_pinned_[vertex] != 0 ? kRings : 0;
  });
  spread_rings(around_, rings.span());
  near_.clear();
  for (Vertex vertex = 0; vertex < around_.n_vertices(); ++vertex) {
    if (rings[vertex] > 0 && are_pinned_[vertex] == 0) near_.push_back(vertex);
  }
  next_mixes_ = Buffer<LabelMix>(near_.size());
  find_near_faces(rings.span());
}

void BorderField::find_near_faces(std::span<const std::uint8_t> rings) {
  near_faces_.clear();
  far_areas_.assign(mesh_.n_labels, 0.0);
  for (Face face = 0; face < around_.n_faces(); ++face) {
    const auto& corners = around_.corners(face).corners;
    if (std::any_of(corners, corners + 3, [&](Vertex v) { return rings[v] > 0; })) {
      near_faces_.push_back(face);
    } else {
      far_areas_[fractions_[face].labels[0]] += around_.area(face);
    }
  }
}

void BorderField::diffuse() {
  const auto n_near = static_cast<std::int64_t>(near_.size());
  team_.for_each_index(n_near, [&](std::int64_t i) { next_mixes_[i] = diffused(near_[i]); });
  team_.for_each_index(n_near, [&](std::int64_t i) { mixes_[near_[i]] = next_mixes_[i]; });
}

// Whether every corner of every face around the vertex has the label of the vertex, and no other.
bool BorderField::is_inside(Vertex vertex) const {
  const LabelMix& own = mixes_[vertex];
  if (!own.is_pure()) return false;
  const auto is_same = [&](Vertex corner) {
    const LabelMix& mix = mixes_[corner];
    return mix.labels[0] == own.labels[0] && mix.is_pure();
  };
  const std::span<const Face> faces = around_.of(vertex);
  return std::ranges::all_of(faces, [&](Face face) {
    const auto& corners = around_.corners(face).corners;
    return std::all_of(corners, corners + 3, is_same);
  });
}

// The label fractions of a vertex after one diffusion step: its own fractions, mixed with the
// cotangent-weighted mean of its neighbors that are not pinned (see kFlow). The weight of a
// neighbor is summed over the faces on the edge to this neighbor.
LabelMix BorderField::diffused(Vertex vertex) const {
  if (is_inside(vertex)) return mixes_[vertex];
  MixSum sum;
  float total = 0.0F;
  const auto flow = [&](Vertex from, float weight) {
    if (from == vertex || are_pinned_[from] != 0) return;
    total += weight;
    sum.add(mixes_[from], weight);
  };
  for (const Face face : around_.of(vertex)) {
    const auto& corners = around_.corners(face).corners;
    const float* cotangents = &cotangents_[3 * static_cast<std::size_t>(face)];
    int at = 0;
    while (at < 2 && corners[at] != vertex) ++at;
    flow(corners[next_corner(at)], cotangents[previous_corner(at)]);
    flow(corners[previous_corner(at)], cotangents[next_corner(at)]);
  }
  if (!(total > 0.0F)) return mixes_[vertex];
  sum.add(mixes_[vertex], total * ((1.0F - kFlow) / kFlow));
  return sum.largest();
}

void BorderField::balance() {
  cut();
  for (int step = 0; step < options_.n_balances; ++step) {
    const std::vector<double> areas = measure_labels();
    for (Label label = 0; label < mesh_.n_labels; ++label) {
      if (!(goals_[label] > 0.0)) continue;
      const double change = steps_[label] * (1.0 - areas[label] / goals_[label]);
      offsets_[label] = std::clamp(offsets_[label] + std::clamp(change, -kMaxStep, kMaxStep),
                                   -kMaxOffset, kMaxOffset);
    }
    cut();
  }
}

// Chooses labels of the vertices near borders, and cuts the faces there.
void BorderField::cut() {
  team_.for_each_index(std::ssize(near_),
                       [&](std::int64_t i) { chosen_[near_[i]] = best_label(mixes_[near_[i]]); });
  team_.for_each_index(std::ssize(near_faces_), [&](std::int64_t i) {
    fractions_[near_faces_[i]] = cut_of(near_faces_[i]).fractions();
  });
}

Label BorderField::best_label(const LabelMix& mix) const {
  Label best = mix.labels[0];
  if (mix.is_pure()) return best;
  double highest = mix.fractions[0] + offsets_[best];
  for (int i = 1; i < LabelMix::kMost && mix.labels[i] != kNoLabel; ++i) {
    const Label label = mix.labels[i];
    const double score = mix.fractions[i] + offsets_[label];
    if (score > highest || (score == highest && label < best)) {
      highest = score;
      best = label;
    }
  }
  return best;
}

// This function runs on one thread, so that areas are added in the order of faces, and sums have
// the same bits in every run.
std::vector<double> BorderField::measure_labels() const {
  std::vector<double> areas = far_areas_;
  for (const Face face : near_faces_) {
    const FaceFractions& parts = fractions_[face];
    for (int i = 0; i < 3 && parts.labels[i] != kNoLabel; ++i) {
      areas[parts.labels[i]] += around_.area(face) * parts.fractions[i];
    }
  }
  return areas;
}

FaceCut BorderField::cut_of(Face face) const {
  const auto& corners = around_.corners(face).corners;
  FaceCut cut;
  cut.whole = kNoLabel;
  for (int corner = 0; corner < 3; ++corner) {
    cut.labels[corner] = chosen_[corners[corner]];
    cut.whole = std::max(cut.whole, cut.labels[corner]);
  }
  if (cut.whole == kNoLabel || mesh_.is_kept[face] != 0) cut.whole = mesh_.labels[face];
  for (int side = 0; side < 3; ++side) {
    cut.crossings[side] = 0.0;
    if (!cut.is_cut(side)) continue;
    cut.crossings[side] = crossing(corners[side], corners[next_corner(side)]);
    ++cut.n_cuts;
  }
  return cut;
}

double BorderField::crossing(Vertex a, Vertex b) const {
  if (a > b) return 1.0 - crossing(b, a);
  const double at_a = lead(a, chosen_[a], chosen_[b]);
  const double at_b = lead(b, chosen_[b], chosen_[a]);
  const double sum = at_a + at_b;
  const double middle = sum > 0.0 ? at_a / sum : 0.5;
  return std::clamp(middle, options_.margin, 1.0 - options_.margin);
}

double BorderField::lead(Vertex vertex, Label own, Label other) const {
  const LabelMix& mix = mixes_[vertex];
  const double gap =
      double{mix.fraction(own)} + offsets_[own] - mix.fraction(other) - offsets_[other];
  return std::max(gap, 0.0);
}

}  // namespace superfacets
