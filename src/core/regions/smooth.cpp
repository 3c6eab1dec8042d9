#include "regions/smooth.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <mutex>
#include <utility>

#include "base/threads.hpp"

namespace superfacets {
namespace {

// Of what a face's sides cost together, the part that a move must win: less may be rounding, and
// two moves that undo each other would go on for ever.
constexpr double kLeastGain = 1e-9;

// A way around a corner that is longer than this is not looked for: on real meshes 6 faces meet at
// a corner, and to leave a face where it is never breaks a region.
constexpr int kLongestFan = 64;

constexpr Face kNoFace = -1;

constexpr float kNotYetKnown = -1.0F;

bool same_position(const Point& a, const Point& b) {
  return a.x == b.x && a.y == b.y && a.z == b.z;
}

// A chain is given up when it has lost this part of what the sides of its first face cost. Without
// the limit compactness would be 0.007 less on the benchmark models, and time half as much again.
constexpr double kDeepest = 0.5;

// A face that may be next in a chain.
struct Candidate {
  Face face = kNoFace;
  double gain = 0.0;
  float travel = 0.0F;  // known when it is its turn
};

struct Move {
  Face face;
  float travel_before;
};

class Smoother {
 public:
  Smoother(const ArcGeometry& arcs, std::span<const double> weights,
           std::span<const Label> first_labels, std::span<const Face> fixed,
           const SmoothOptions& options, ThreadTeam& team)
      : arcs_(arcs),
        weights_(weights),
        first_labels_(first_labels),
        options_(options),
        labels_(first_labels.size()),
        travels_(first_labels.size()),
        is_waiting_(first_labels.size()),
        is_fixed_(first_labels.size()),
        costs_(arcs.neighbors.size()) {
    const auto n_faces = static_cast<std::int64_t>(first_labels.size());
    team.for_each_block(n_faces, [&](std::int64_t begin, std::int64_t end) {
      std::copy(first_labels.begin() + begin, first_labels.begin() + end, labels_.begin() + begin);
      std::fill(travels_.begin() + begin, travels_.begin() + end, 0.0F);
      std::fill(is_waiting_.begin() + begin, is_waiting_.begin() + end, 0);
      std::fill(is_fixed_.begin() + begin, is_fixed_.begin() + end, 0);
    });
    team.fill(costs_.span(), kNotYetKnown);
    for (const Face face : fixed) is_fixed_[face] = 1;
  }

  Buffer<Label> run(ThreadTeam& team) {
    std::vector<Face> waiting = border_faces(team);
    for (int sweep = 0; sweep < options_.max_sweeps && !waiting.empty(); ++sweep) {
      for (const Face face : waiting) is_waiting_[face] = 0;
      next_.clear();
      for (const Face face : waiting) try_moves(face);
      std::sort(next_.begin(), next_.end());
      waiting.swap(next_);
    }
    return std::move(labels_);
  }

 private:
  std::vector<Face> border_faces(ThreadTeam& team) const {
    std::vector<Face> found;
    std::mutex mutex;
    const auto n_faces = static_cast<std::int64_t>(labels_.size());
    team.for_each_block(n_faces, [&](std::int64_t begin, std::int64_t end) {
      std::vector<Face> part;
      for (auto face = static_cast<Face>(begin); face < end; ++face) {
        if (is_at_border(face)) part.push_back(face);
      }
      const std::scoped_lock lock(mutex);
      found.insert(found.end(), part.begin(), part.end());
    });
    std::sort(found.begin(), found.end());
    return found;
  }

  bool is_at_border(Face face) const {
    for (std::int64_t arc = arcs_.offsets[face]; arc < arcs_.offsets[face + 1]; ++arc) {
      if (labels_[arcs_.neighbors[arc]] != labels_[face]) return true;
    }
    return false;
  }

  // Moves a face, and what is won by moving it as well, to the first neighboring region where that
  // pays.
  void try_moves(Face face) {
    const Label from = labels_[face];
    Label tried = from;
    for (std::int64_t arc = arcs_.offsets[face]; arc < arcs_.offsets[face + 1]; ++arc) {
      const Label to = labels_[arcs_.neighbors[arc]];
      if (to == from || to == tried) continue;
      if (move_chain(face, to)) return;
      tried = to;
    }
  }

  // Moves faces one after the other, each the best that is next to those moved, and takes back what
  // comes after the best state. That a step on the way may lose is what gets a border over a row of
  // triangles (Kernighan and Lin 1970 do so with pairs); as each step keeps regions connected, so
  // does every state. Returns whether something has moved.
  bool move_chain(Face first, Label to) {
    const Label from = labels_[first];
    const std::size_t best_size = grow_chain(first, from, to);
    for (std::size_t i = best_size; i < chain_.size(); ++i) {
      labels_[chain_[i].face] = from;
      travels_[chain_[i].face] = chain_[i].travel_before;
    }
    for (std::size_t i = 0; i < best_size; ++i) look_again_around(chain_[i].face);
    return best_size > 0;
  }

  // Returns how many of the moves of the chain make borders cheapest; 0 if none do.
  std::size_t grow_chain(Face first, Label from, Label to) {
    const double cost = cost_of_sides(first);
    double gain = 0.0;
    double best_gain = kLeastGain * cost;
    std::size_t best_size = 0;
    chain_.clear();
    candidates_.assign({{first, gain_of(first, from, to), 0.0F}});
    while (chain_.size() < options_.max_chain) {
      const Candidate next = take_candidate(from, to, -kDeepest * cost - gain);
      if (next.face == kNoFace) break;
      gain += next.gain;
      chain_.push_back({next.face, travels_[next.face]});
      travels_[next.face] = next.travel;
      labels_[next.face] = to;
      if (gain > best_gain) {
        best_gain = gain;
        best_size = chain_.size();
      }
      add_candidates(next.face, from, to);
    }
    return best_size;
  }

  // The best candidate that may move, out of the list; kNoFace if none wins as much as it has to.
  Candidate take_candidate(Label from, Label to, double least_gain) {
    while (!candidates_.empty()) {
      const auto best = std::max_element(
          candidates_.begin(), candidates_.end(), [](const Candidate& a, const Candidate& b) {
            return std::pair(a.gain, b.face) < std::pair(b.gain, a.face);
          });
      Candidate taken = *best;
      if (taken.gain < least_gain) break;
      *best = candidates_.back();
      candidates_.pop_back();
      const double travel = travel_of(taken.face, to);
      taken.travel = static_cast<float>(travel);
      if (travel <= options_.max_distance && may_leave(taken.face, from)) return taken;
    }
    return {};
  }

  // Neighbors of a face that has just moved: what they win is now more than it was.
  void add_candidates(Face moved, Label from, Label to) {
    for (std::int64_t arc = arcs_.offsets[moved]; arc < arcs_.offsets[moved + 1]; ++arc) {
      const Face face = arcs_.neighbors[arc];
      if (labels_[face] != from) continue;
      const Candidate candidate{face, gain_of(face, from, to), 0.0F};
      const auto known = std::find_if(candidates_.begin(), candidates_.end(),
                                      [&](const Candidate& other) { return other.face == face; });
      if (known == candidates_.end()) {
        candidates_.push_back(candidate);
      } else {
        *known = candidate;
      }
    }
  }

  // How much cheaper borders get if a face moves.
  double gain_of(Face face, Label from, Label to) {
    double gain = 0.0;
    for (std::int64_t arc = arcs_.offsets[face]; arc < arcs_.offsets[face + 1]; ++arc) {
      const Label label = labels_[arcs_.neighbors[arc]];
      if (label == to) gain += cost_of(face, arc);
      if (label == from) gain -= cost_of(face, arc);
    }
    return gain;
  }

  double cost_of_sides(Face face) {
    double sum = 0.0;
    for (std::int64_t arc = arcs_.offsets[face]; arc < arcs_.offsets[face + 1]; ++arc) {
      sum += cost_of(face, arc);
    }
    return sum;
  }

  // Costs are found when first asked for: few arcs are near a border.
  double cost_of(Face face, std::int64_t arc) {
    float& cost = costs_[arc];
    if (cost == kNotYetKnown) {
      cost = static_cast<float>(options_.border_cost(arcs_, weights_, face, arc));
    }
    return cost;
  }

  // How far a face would be from the border that a region had at first, on a path along faces that
  // have moved to it.
  double travel_of(Face face, Label to) const {
    if (first_labels_[face] == to) return 0.0;
    double shortest = std::numeric_limits<double>::infinity();
    for (std::int64_t arc = arcs_.offsets[face]; arc < arcs_.offsets[face + 1]; ++arc) {
      const Face neighbor = arcs_.neighbors[arc];
      if (labels_[neighbor] != to) continue;
      const double step = weights_[arc] * options_.border_cost.diagonal;
      const bool is_at_border = first_labels_[neighbor] == to;  // which is half way
      shortest = std::min(shortest, is_at_border ? 0.5 * step : step + travels_[neighbor]);
    }
    return shortest;
  }

  // Whether a region surely hangs together, and has faces, without this one: it touches the rest by
  // one face, or by two that hang together around the corner between them.
  bool may_leave(Face face, Label from) {
    if (is_fixed_[face]) return false;
    std::array<std::int64_t, 2> ways{};
    std::size_t n_ways = 0;
    for (std::int64_t arc = arcs_.offsets[face]; arc < arcs_.offsets[face + 1]; ++arc) {
      const Face neighbor = arcs_.neighbors[arc];
      if (labels_[neighbor] != from) continue;
      if (n_ways > 0 && arcs_.neighbors[ways[0]] == neighbor) continue;
      if (n_ways > 1 && arcs_.neighbors[ways[1]] == neighbor) continue;
      if (n_ways == ways.size()) return false;
      ways[n_ways++] = arc;
    }
    return n_ways == 1 || (n_ways == 2 && hang_together(face, ways[0], ways[1]));
  }

  // Whether two neighbors of a face in one region are joined by faces of it, other than that one,
  // around the corner that they share. Walks from one to the other; where an edge has several ways
  // on, it gives up.
  bool hang_together(Face face, std::int64_t first_way, std::int64_t second_way) const {
    const int first_side = arcs_.sides[first_way];
    const int second_side = arcs_.sides[second_way];
    if (first_side == second_side) return false;
    const int corner = (first_side + 1) % 3 == second_side ? second_side : first_side;
    const Vertex center = arcs_.faces[face].corners[corner];
    const Face goal = arcs_.neighbors[second_way];
    Face before = face;
    Face here = arcs_.neighbors[first_way];
    for (int n_steps = 0; here != goal; ++n_steps) {
      const Face next = n_steps < kLongestFan ? next_around(center, before, here) : kNoFace;
      if (next == kNoFace || next == face || labels_[next] != labels_[face]) return false;
      before = std::exchange(here, next);
    }
    return true;
  }

  // The face that follows around a corner, or kNoFace where there is none or more than one.
  Face next_around(Vertex center, Face before, Face here) const {
    const int corner = corner_at(here, center);
    if (corner < 0) return kNoFace;
    Face next = kNoFace;
    for (std::int64_t arc = arcs_.offsets[here]; arc < arcs_.offsets[here + 1]; ++arc) {
      const bool leads_around = arcs_.sides[arc] != (corner + 1) % 3;
      if (!leads_around || arcs_.neighbors[arc] == before) continue;
      if (next != kNoFace) return kNoFace;
      next = arcs_.neighbors[arc];
    }
    return next;
  }

  // The corner of a face at a vertex, or at its position; -1 if there is none.
  int corner_at(Face face, Vertex vertex) const {
    const Triangle& triangle = arcs_.faces[face];
    for (int corner = 0; corner < 3; ++corner) {
      if (triangle.corners[corner] == vertex) return corner;
    }
    for (int corner = 0; corner < 3; ++corner) {
      const bool is_there =
          same_position(arcs_.vertices[triangle.corners[corner]], arcs_.vertices[vertex]);
      if (is_there) return corner;
    }
    return -1;
  }

  void look_again_around(Face face) {
    look_again_at(face);
    for (std::int64_t arc = arcs_.offsets[face]; arc < arcs_.offsets[face + 1]; ++arc) {
      look_again_at(arcs_.neighbors[arc]);
    }
  }

  void look_again_at(Face face) {
    if (is_waiting_[face]) return;
    is_waiting_[face] = 1;
    next_.push_back(face);
  }

  const ArcGeometry& arcs_;
  const std::span<const double> weights_;
  const std::span<const Label> first_labels_;
  const SmoothOptions options_;
  Buffer<Label> labels_;
  Buffer<float> travels_;            // of faces that are not in their first region: travel_of
  Buffer<std::uint8_t> is_waiting_;  // for the next sweep
  Buffer<std::uint8_t> is_fixed_;
  Buffer<float> costs_;      // of arcs, kNotYetKnown at first
  std::vector<Face> next_;   // faces to look at in the next sweep
  std::vector<Move> chain_;  // moved, in this order, and their travel before
  std::vector<Candidate> candidates_;
};

}  // namespace

Buffer<Label> smooth_borders(const ArcGeometry& arcs, std::span<const double> weights,
                             std::span<const Label> labels, std::span<const Face> fixed,
                             const SmoothOptions& options, ThreadTeam& team) {
  return Smoother(arcs, weights, labels, fixed, options, team).run(team);
}

}  // namespace superfacets
