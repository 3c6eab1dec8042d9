#include "cells/weights.hpp"

#include "base/elementary.hpp"
#include "base/point_block.hpp"
#include "cells/ridges.hpp"

namespace superfacets {
namespace {

// If a face has more arcs than this number, its arcs are not searched for a reverse arc, because
// computing the weight twice is faster.
constexpr std::int64_t kFewArcs = 8;

// Number of faces per block. The data of a block and of its neighbors fits into the first-level
// cache.
constexpr std::int64_t kFacesPerList = 64;

// Number of arcs whose weights are computed together. Only weights of arcs to faces with a higher
// index are computed. On most meshes, kFacesPerList faces have at most this many such arcs.
constexpr std::size_t kArcsPerBlock = 128;

// Unit normals of faces. The normals of a range of faces are stored. Sorted faces have most of
// their neighbors in the same range; the normals of all other faces are computed when needed.
class FaceNormals {
 public:
  explicit FaceNormals(const TriangleSurface& surface) : surface_(surface) {}

  // Stores the normals of faces begin .. end-1.
  void store(std::int64_t begin, std::int64_t end) {
    begin_ = begin;
    stored_.resize(end - begin);
    write_unit_normals(surface_.vertices(), surface_.faces().subspan(begin, end - begin), stored_);
  }

  Point operator[](Face face) const {
    const auto i = static_cast<std::size_t>(face - begin_);  // very large if face < begin_
    if (i < stored_.size()) return stored_[i];
    return unit_normal(surface_.vertices(), surface_.faces()[face]);
  }

 private:
  const TriangleSurface& surface_;
  std::int64_t begin_ = 0;
  std::vector<Point> stored_;
};

// The data of a mesh from which eq. 1-3 compute weights.
struct Geometry {
  const TriangleSurface& surface;
  const FaceMeasures& faces;
  const FaceNormals& normals;

  const Arcs& arcs() const { return surface.arcs(); }
};

// Factor, 1 or -1, that makes the rise (see Fold) positive at concave edges.
double up_of(const Geometry& geometry) {
  return geometry.surface.is_inside_out() ? -1.0 : 1.0;
}

// The inputs from which the weight of an arc is computed. Swapping the two faces changes no bit of
// the weight.
struct ArcData {
  Edge edge;
  Point from;  // centroid of the first face
  Point to;    // centroid of the second face
  Point normal_from;
  Point normal_to;
};

SUPERFACETS_ALWAYS_INLINE ArcData arc_data(const Geometry& geometry, Face from, Face to,
                                           std::int64_t arc) {
  const auto& centroids = geometry.faces.centroids;
  const auto& areas = geometry.faces.areas;
  ArcData data{geometry.surface.edge(from, arc), centroids[from], centroids[to],
               geometry.normals[from], geometry.normals[to]};
  if (geometry.surface.same_turn(arc)) {
    Point& turned =
        turns_second(from, to, areas[from], areas[to]) ? data.normal_to : data.normal_from;
    turned = -1.0 * turned;
  }
  return data;
}

// Angle between the two faces of an arc, and whether the edge is concave.
struct ArcTurn {
  double theta;
  double rise;  // positive if concave; a bool would prevent vectorization
};

SUPERFACETS_ALWAYS_INLINE ArcTurn arc_turn(const ArcData& data, double up) {
  const Fold fold = fold_of(data.normal_from, data.normal_to, data.to - data.from);
  return {arctangent(fold.sine, fold.cosine), up * fold.rise};
}

// Versions of eq. 1-3.
enum class Formula : std::uint8_t {
  kEdgeLengths,  // the published formula: the angular term is proportional to the edge length
  kOneLength,    // the edge length is replaced by the constant crease_length
  kStraight,     // like kOneLength, with straight steps (see EdgeFactors::is_straight)
};

// Calls run(formula), where `formula` is a std::integral_constant chosen from the factors.
template <typename Run>
auto with_formula(const EdgeFactors& factors, const Run& run) {
  if (factors.is_straight) return run(std::integral_constant<Formula, Formula::kStraight>{});
  return factors.crease_length > 0.0
             ? run(std::integral_constant<Formula, Formula::kOneLength>{})
             : run(std::integral_constant<Formula, Formula::kEdgeLengths>{});
}

template <Formula kFormula>
SUPERFACETS_ALWAYS_INLINE double arc_weight(const ArcData& data, const ArcTurn& turned,
                                            const EdgeFactors& factors) {
  const double length =
      kFormula == Formula::kEdgeLengths ? data.edge.length() : factors.crease_length;
  const double eta = factors.eta(turned.rise, turned.theta);
  const double angular = factors.angular(eta, length, turned.theta);
  const double step = kFormula == Formula::kStraight ? norm(data.to - data.from)
                                                     : length_over(data.edge, data.from, data.to);
  return (step + angular) / factors.diagonal;
}

double any_arc_weight(const ArcData& data, const EdgeFactors& factors, double up) {
  const ArcTurn turned = arc_turn(data, up);
  return with_formula(
      factors, [&](auto formula) { return arc_weight<formula.value>(data, turned, factors); });
}

SUPERFACETS_ALWAYS_INLINE double turn_of(const ArcData& data, const ArcTurn& turned) {
  return (turned.rise > 0.0 ? -turned.theta : turned.theta) * data.edge.length();
}

// Provides the angle and convexity of each edge to the class Ridges.
struct FaceBends {
  const Geometry& geometry;

  double angle(Face face, std::int64_t arc, Face other) const {
    // flipping either normal negates the cosine
    const double sign = geometry.surface.same_turn(arc) ? -1.0 : 1.0;
    const Fold fold =
        fold_of(geometry.normals[face], sign * geometry.normals[other], {0.0, 0.0, 0.0});
    return arctangent(fold.sine, fold.cosine);
  }
  bool is_convex(Face face, std::int64_t arc, Face other) const {
    const ArcData data = arc_data(geometry, face, other, arc);
    const Fold fold = fold_of(data.normal_from, data.normal_to, data.to - data.from);
    return !(up_of(geometry) * fold.rise > 0.0);
  }
};

// The only arc from one face to another. Returns -1 if there is no such arc or more than one, or if
// the face has more than kFewArcs arcs. The search is branch-free, because the position in the list
// is unpredictable.
SUPERFACETS_ALWAYS_INLINE std::int64_t only_arc(const Arcs& arcs, Face from, Face to) {
  const auto neighbors = arcs.neighbors(from);
  const std::int64_t first = arcs.offsets[from];
  if (neighbors.size() == 3) {  // true for nearly all faces
    const auto is_second = static_cast<std::int64_t>(neighbors[1] == to);
    const auto is_third = static_cast<std::int64_t>(neighbors[2] == to);
    const std::int64_t n_found =
        static_cast<std::int64_t>(neighbors[0] == to) + is_second + is_third;
    return n_found == 1 ? first + is_second + 2 * is_third : -1;
  }
  if (std::cmp_greater(neighbors.size(), kFewArcs)) return -1;
  std::int64_t n_found = 0;
  std::int64_t sum = 0;
  for (const auto [arc, neighbor] : arcs.steps(from)) {
    const std::int64_t is_found = neighbor == to;
    n_found += is_found;
    sum += is_found * arc;
  }
  return n_found == 1 ? sum : -1;
}

struct RisingArc {
  Face from;
  Face to;  // target face; its index is higher than `from`
  std::int64_t arc;
};

// Lists the arcs from faces begin .. end-1 to faces with a higher index, and prefetches the data of
// these higher faces. The data may be anywhere in memory, and a cache miss takes longer than the
// arithmetic.
void list_rising_arcs(const Geometry& geometry, std::int64_t begin, std::int64_t end,
                      std::vector<RisingArc>& rising) {
  const Arcs& arcs = geometry.arcs();
  const auto vertices = geometry.surface.vertices();
  rising.resize(arcs.offsets[end] - arcs.offsets[begin]);
  std::size_t n_rising = 0;
  for (std::int64_t face = begin; face < end; ++face) {
    for (const Vertex corner : geometry.surface.faces()[face].corners) prefetch(&vertices[corner]);
    for (const auto [arc, neighbor] : arcs.steps(static_cast<Face>(face))) {
      rising[n_rising] = {static_cast<Face>(face), neighbor, arc};
      n_rising += static_cast<std::size_t>(
          face < neighbor);  // no branch, because the comparison is unpredictable
    }
  }
  rising.resize(n_rising);
  for (const RisingArc& step : rising) {
    prefetch(&arcs.offsets[step.to]);
    prefetch(&geometry.faces.centroids[step.to]);
  }
  // Computes an address instead of indexing, because the offset of a face without arcs may be one
  // past the last arc.
  for (const RisingArc& step : rising) prefetch(arcs.targets.data() + arcs.offsets[step.to]);
}

using Numbers = std::array<double, kArcsPerBlock>;
using Points = PointBlock<kArcsPerBlock>;

struct Block {
  Points start;
  Points end;
  Points from;
  Points to;
  Points normal_from;
  Points normal_to;

  SUPERFACETS_ALWAYS_INLINE void set(std::size_t i, const ArcData& data) {
    start.set(i, data.edge.start);
    end.set(i, data.edge.end);
    from.set(i, data.from);
    to.set(i, data.to);
    normal_from.set(i, data.normal_from);
    normal_to.set(i, data.normal_to);
  }
  SUPERFACETS_ALWAYS_INLINE ArcData get(std::size_t i) const {
    return {
        {start.get(i), end.get(i)}, from.get(i), to.get(i), normal_from.get(i), normal_to.get(i)};
  }
};

// Computes the weights of the first n arcs of a block, and their net turns (see NetTurn) if
// kHasTurns.
template <Formula kFormula, bool kHasTurns>
struct Weigh {
  SUPERFACETS_ALWAYS_INLINE void operator()(const Block& block, const EdgeFactors& factors,
                                            double up, const NetTurn& net_turn, Numbers* weights,
                                            Numbers* turns, std::size_t n) const {
    const EdgeFactors hoisted =
        factors;  // local copy, so the compiler knows that stores cannot alias it
    const NetTurn rounding = net_turn;
    for (std::size_t i = 0; i < n; ++i) {
      const ArcData data = block.get(i);
      const ArcTurn turned = arc_turn(data, up);
      (*weights)[i] = arc_weight<kFormula>(data, turned, hoisted);
      if constexpr (kHasTurns) (*turns)[i] = rounding.rounded(turn_of(data, turned));
    }
  }
};

// Whether an arc and its reverse are the only arcs between two faces. Sets `back` to the reverse
// arc, or to -1 if only_arc finds none.
bool is_pair(const Arcs& arcs, const RisingArc& step, std::int64_t& back) {
  back = only_arc(arcs, step.to, step.from);
  return back >= 0 && only_arc(arcs, step.from, step.to) == step.arc;
}

// Computes the weights of arcs to faces with a higher index, and copies each weight to the reverse
// arc if the reverse arc is unique.
class Weigher {
 public:
  Weigher(const TriangleSurface& surface, const FaceMeasures& faces, const EdgeFactors& factors,
          bool wants_sums, const CrowdedFaces& crowded, const ArcWriter& writer)
      : normals_(surface),
        geometry_{surface, faces, normals_},
        factors_(factors),
        of_ridges_(factors.of_ridges()),
        bends_{geometry_},
        ridges_(surface, bends_, crowded),
        wants_sums_(wants_sums),
        net_turn_(factors.diagonal),
        writer_(writer) {}

  // Sums over all arcs processed so far.
  const EdgeSums& sums() const { return sums_; }
  double total() const { return total_; }  // sum of all weights written so far

  // Processes the arcs that leave faces begin .. end-1. Returns the number of weights written.
  std::int64_t weigh_range(std::int64_t begin, std::int64_t end) {
    std::int64_t n_weighed = 0;
    normals_.store(begin, end);
    for (std::int64_t first = begin; first < end; first += kFacesPerList) {
      list_rising_arcs(geometry_, first, std::min(end, first + kFacesPerList), listed_);
      for (std::span<const RisingArc> rest = listed_; !rest.empty();) {
        const auto some = rest.first(std::min(rest.size(), kArcsPerBlock));
        n_weighed += weigh_block(some);
        rest = rest.subspan(some.size());
      }
    }
    return n_weighed;
  }

 private:
  std::int64_t weigh_block(std::span<const RisingArc> rising) {
    for (std::size_t i = 0; i < rising.size(); ++i) {
      block_.set(i, arc_data(geometry_, rising[i].from, rising[i].to, rising[i].arc));
    }
    with_formula(factors_, [&](auto formula) { weigh_in_vectors<formula.value>(rising.size()); });
    if (factors_.has_ridges()) weigh_ridges(rising);
    if (wants_sums_) add_turns(rising.size());
    std::int64_t n_weighed = std::ssize(rising);
    for (std::size_t i = 0; i < rising.size(); ++i) {
      writer_.write(rising[i].arc, numbers_[i]);
      total_ += numbers_[i];
      std::int64_t back = -1;
      if (!is_pair(geometry_.arcs(), rising[i], back)) continue;
      writer_.write(back, numbers_[i]);
      total_ += numbers_[i];
      ++n_weighed;
    }
    return n_weighed;
  }

  template <Formula kFormula>
  void weigh_in_vectors(std::size_t n) {
    const double up = up_of(geometry_);
    const auto run = [&](const auto& weigh) {
      run_version(with_, weigh, block_, factors_, up, net_turn_, &numbers_, &turns_, n);
    };
    if (wants_sums_) return run(Weigh<kFormula, true>{});
    run(Weigh<kFormula, false>{});
  }

  void add_turns(std::size_t n) {
    double sum = 0.0;  // exact, because all terms are integers
    for (std::size_t i = 0; i < n; ++i) sum += turns_[i];
    sums_.turn += static_cast<std::int64_t>(sum);
  }

  // Replaces the weights of arcs across ridges, and counts edges (see EdgeSums).
  void weigh_ridges(std::span<const RisingArc> rising) {
    const double up = up_of(geometry_);
    for (std::size_t i = 0; i < rising.size(); ++i) {
      cosines_[i] = dot(block_.normal_from.get(i), block_.normal_to.get(i));
    }
    count_edges(rising.size());
    for (std::size_t i = 0; i < rising.size(); ++i) {
      if (cosines_[i] > kSharpCosine) continue;  // not sharp, like most arcs
      const RisingArc& step = rising[i];
      const ArcData data = block_.get(i);
      if (up * dot(data.normal_from - data.normal_to, data.to - data.from) > 0.0) continue;
      if (!ridges_.crosses(step.from, step.arc)) continue;
      numbers_[i] = any_arc_weight(data, of_ridges_, up);
      turns_[i] = 0.0;
    }
  }

  void count_edges(std::size_t n) {
    if (!wants_sums_) return;
    double bent = 0.0;  // exact, because all terms are integers
    double sharp = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      sums_.n_flat += static_cast<std::int64_t>(cosines_[i] > kFlatCosine);
      bent += std::abs(turns_[i]);
      sharp += cosines_[i] <= kSharpCosine ? std::abs(turns_[i]) : 0.0;
    }
    sums_.n_edges += static_cast<std::int64_t>(n);
    sums_.bent += static_cast<std::int64_t>(bent);
    sums_.sharp += static_cast<std::int64_t>(sharp);
  }

  FaceNormals normals_;
  const Geometry geometry_;
  const EdgeFactors& factors_;
  const EdgeFactors of_ridges_;
  const FaceBends bends_;
  const Ridges<TriangleSurface, FaceBends> ridges_;
  const bool wants_sums_;
  const NetTurn net_turn_;
  const ArcWriter& writer_;
  double total_ = 0.0;
  const InstructionSet with_ = best_instruction_set();
  std::vector<RisingArc> listed_;
  Block block_;
  Numbers numbers_;
  Numbers cosines_;
  Numbers turns_;
  EdgeSums sums_;
};

// Computes the weights that class Weigher skips: weights of arcs to faces with a lower index for
// which is_pair is false. Returns their sum.
double weigh_other_arcs(const Geometry& geometry, const EdgeFactors& factors,
                        const CrowdedFaces& crowded, std::int64_t begin, std::int64_t end,
                        const ArcWriter& writer) {
  double total = 0.0;
  const double up = up_of(geometry);
  const EdgeFactors of_ridges = factors.of_ridges();
  const FaceBends bends{geometry};
  const Ridges ridges(geometry.surface, bends, crowded);
  for (auto face = static_cast<Face>(begin); face < end; ++face) {
    for (const auto [arc, neighbor] : geometry.arcs().steps(face)) {
      std::int64_t back = -1;
      if (neighbor > face || is_pair(geometry.arcs(), {face, neighbor, arc}, back)) continue;
      const ArcData data = arc_data(geometry, face, neighbor, arc);
      const bool is_ridge = factors.has_ridges() && ridges.crosses(face, arc);
      const double weight = any_arc_weight(data, is_ridge ? of_ridges : factors, up);
      writer.write(arc, weight);
      total += weight;
    }
  }
  return total;
}

}  // namespace

WeighedArcs triangle_weights(const TriangleSurface& surface, const FaceMeasures& faces,
                             const EdgeFactors& factors, bool wants_sums, ThreadTeam& team) {
  SUPERFACETS_ASSERT(std::cmp_equal(faces.centroids.size(), surface.n_cells()) &&
                     faces.areas.size() == faces.centroids.size());
  SUPERFACETS_ASSERT(factors.diagonal > 0.0);
  SUPERFACETS_ASSERT(!factors.is_straight || factors.crease_length > 0.0 || factors.alpha == 0.0);
  const FaceNormals normals(surface);
  const Geometry geometry{surface, faces, normals};
  const CrowdedFaces crowded = crowded_faces(surface.arcs(), FaceBends{geometry}, factors);
  const std::int64_t n = surface.n_cells();
  EdgeSums sums;
  std::mutex adding;  // protects the sums; sums of integers do not depend on the order of terms
  const auto weigh = [&](const ArcWriter& writer, std::int64_t every) {
    std::atomic<std::int64_t> n_weighed = 0;
    sums = {};
    const auto weigh_block = [&](std::int64_t begin, std::int64_t end) {
      Weigher weigher(surface, faces, factors, wants_sums, crowded, writer);
      n_weighed += weigher.weigh_range(begin, end);
      const std::scoped_lock lock(adding);
      sums.add(weigher.sums());
      return weigher.total();
    };
    const double total = sum_of_sample(n, every, weigh_block, team);
    if (every > 1 || n_weighed == surface.arcs().n_arcs()) return total;
    const auto weigh_others = [&](std::int64_t begin, std::int64_t end) {
      return weigh_other_arcs(geometry, factors, crowded, begin, end, writer);
    };
    return total + sum_of_sample(n, 1, weigh_others, team);
  };
  WeighedArcs weighed = weigh_arcs(surface.arcs(), factors.unit_factor, weigh);
  weighed.sums = sums;
  return weighed;
}

}  // namespace superfacets
