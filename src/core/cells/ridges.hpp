// Ridges: sharp convex edges between flat faces, as on machine parts. Rounded limbs have no ridges,
// because their edges all have small angles.
#pragma once

#include "cells/weights.hpp"

namespace superfacets {

// Slightly more than the cosine of kSharpAngle. If the cosine of the angle between two normals is
// larger, the edge is not sharp.
inline constexpr double kSharpCosine = 0.7661;

// The cosine of kFlatAngle.
inline constexpr double kFlatCosine = 0.9999996192282494;

// An edge is flat compared with a ridge if its angle is less than this fraction of the ridge's
// angle.
inline constexpr double kFlatFraction = 0.3;

// Two edges are similarly sharp if the smaller angle is at least this fraction of the larger angle.
inline constexpr double kSimilarFraction = 0.7;

// The next three functions compare the angle `bend` of an edge with the angle `turn` of a ridge. If
// all three are false, the edge is about as sharp as the ridge, like the edges at the corner of a
// box.
inline bool is_flat(double bend, double turn) {
  return bend < kFlatFraction * turn;
}
inline bool is_dull(double bend, double turn) {
  return bend < std::max(kSharpAngle, kSimilarFraction * turn);
}
inline bool is_sharper(double bend, double turn) {
  return turn < kSimilarFraction * bend;
}

// Search index for the arcs of faces with many neighbors. Without the index, the time at such a
// face would be quadratic in its number of arcs, because each arc examines all other arcs.
class CrowdedFaces {
 public:
  struct ArcTo {
    Cell to;
    std::int64_t arc;
    auto operator<=>(const ArcTo&) const = default;  // by target, then by arc
  };
  struct Crowd {
    std::vector<ArcTo> neighbors;  // arcs of the face, sorted by target, then by arc
    std::vector<double> bends;     // angles of all arcs of the face, ascending

    std::span<const ArcTo> arcs_to(Cell to) const {
      const auto first = std::lower_bound(neighbors.begin(), neighbors.end(), ArcTo{to, 0});
      const auto last = std::lower_bound(first, neighbors.end(), ArcTo{to + 1, 0});
      return {first, last};
    }

    // Number of angles for which the condition `holds` is false. If the condition is false for an
    // angle, it must be false for all larger angles.
    template <typename Holds>
    std::int64_t n_after(const Holds& holds) const {
      return bends.end() - std::partition_point(bends.begin(), bends.end(), holds);
    }
    std::int64_t n_bent(double turn) const {
      return n_after([&](double bend) { return is_flat(bend, turn); });
    }
    std::int64_t n_alike(double turn) const {
      const auto n_least = n_after([&](double bend) { return is_dull(bend, turn); });
      return std::min(n_bent(turn), n_least) -
             n_after([&](double bend) { return !is_sharper(bend, turn); });
    }
  };

  CrowdedFaces() = default;  // an empty index, for weights without ridges

  // Builds the index; bend(face, arc, to) must return the angle at an arc.
  template <typename Bend>
  CrowdedFaces(const Arcs& arcs, const Bend& bend) {
    for (Face face = 0; face < arcs.n_cells(); ++face) {
      if (arcs.neighbors(face).size() <= kMaxInARow) continue;
      faces_.push_back(face);
      Crowd& crowd = crowds_.emplace_back();
      for (const auto [arc, to] : arcs.steps(face)) {
        crowd.neighbors.push_back({to, arc});
        crowd.bends.push_back(bend(face, arc, to));
      }
      std::sort(crowd.neighbors.begin(), crowd.neighbors.end());
      std::sort(crowd.bends.begin(), crowd.bends.end());
    }
  }

  // Returns the entry of a face, or null if the face has few arcs.
  const Crowd* find(const Arcs& arcs, Face face) const {
    if (arcs.neighbors(face).size() <= kMaxInARow) return nullptr;
    return &crowds_[std::lower_bound(faces_.begin(), faces_.end(), face) - faces_.begin()];
  }

 private:
  // Up to this number of arcs, linear search is faster.
  static constexpr std::size_t kMaxInARow = 32;
  std::vector<Face> faces_;  // the faces in the index, ascending
  std::vector<Crowd> crowds_;
};

// Builds the index of the faces with many arcs. The index is empty if the factors do not use
// ridges.
template <typename Bends>
CrowdedFaces crowded_faces(const Arcs& arcs, const Bends& bends, const EdgeFactors& factors) {
  if (!factors.has_ridges()) return {};
  return {arcs, [&](Face face, std::int64_t arc, Face to) { return bends.angle(face, arc, to); }};
}

// Finds the ridges of a surface of faces. A ridge is a convex edge with an angle of at least
// kSharpAngle between two faces whose other edges are flat or similarly sharp (see is_flat_beside).
// Both ends of a ridge must meet another edge with these properties, the boundary of the surface,
// or a non-manifold edge. Two faces that share several edges have no ridge.
//
// The parameter `bends` provides two functions. bends.angle(face, arc, to) is the unsigned angle at
// an arc, from 0 to pi. bends.is_convex(face, arc, to) returns whether the arc is convex.
template <typename AnySurface, typename Bends>
class Ridges {
 public:
  Ridges(const AnySurface& surface, const Bends& bends, const CrowdedFaces& crowded)
      : surface_(surface), bends_(bends), crowded_(crowded) {}

  // Whether an arc crosses a ridge. An arc and its reverse arc give the same result.
  bool crosses(Face from, std::int64_t arc) const {
    const Face to = surface_.arcs().targets[arc];
    if (!is_sharp_between_flats(from, arc, to)) return false;
    const std::int64_t back = arc_between(to, from);
    if (to < from && back >= 0) return continues_at_ends(to, back, from);
    return continues_at_ends(from, arc, to);
  }

 private:
  static constexpr int kLongestFan = 64;  // maximum number of faces visited around a corner

  // Whether an arc crosses a sharp convex edge that is the only edge shared by its two faces.
  bool is_sharp(Face from, std::int64_t arc, Face to) const {
    return bends_.angle(from, arc, to) >= kSharpAngle && bends_.is_convex(from, arc, to) &&
           arc_between(from, to) >= 0;
  }

  // The only arc from one face to another, or -1 if there is no arc or several arcs.
  std::int64_t arc_between(Face from, Face to) const {
    if (const CrowdedFaces::Crowd* crowd = crowded_.find(surface_.arcs(), from)) {
      const auto between = crowd->arcs_to(to);
      return between.size() == 1 ? between.front().arc : -1;
    }
    std::int64_t found = -1;
    for (const auto [arc, neighbor] : surface_.arcs().steps(from)) {
      if (neighbor != to) continue;
      if (found >= 0) return -1;
      found = arc;
    }
    return found;
  }

  bool is_sharp_between_flats(Face from, std::int64_t arc, Face to) const {
    const double turn = bends_.angle(from, arc, to);
    return is_sharp(from, arc, to) && is_flat_beside(from, to, turn) &&
           is_flat_beside(to, from, turn);
  }

  // Whether a face is flat next to an edge with the angle `turn`. Each other edge of the face must
  // be flat, or similarly sharp, as at the corner of a box. A triangle must also have at least one
  // flat edge, because otherwise all edges of a coarse ball would be ridges. A polygon needs no
  // flat edge, because it is flat inside.
  bool is_flat_beside(Face face, Face other, double turn) const {
    if (const CrowdedFaces::Crowd* crowd = crowded_.find(surface_.arcs(), face)) {
      return is_flat_in_crowd(*crowd, face, other, turn);
    }
    int n_sharp = 0;
    for (const auto [arc, to] : surface_.arcs().steps(face)) {
      if (to == other) continue;
      const double bend = bends_.angle(face, arc, to);
      if (is_flat(bend, turn)) continue;
      if (is_dull(bend, turn) || is_sharper(bend, turn)) return false;
      if (++n_sharp > 1 && surface_.n_sides(face) == 3) return false;
    }
    return true;
  }

  // Version of is_flat_beside for a face with many arcs.
  bool is_flat_in_crowd(const CrowdedFaces::Crowd& crowd, Face face, Face other,
                        double turn) const {
    std::int64_t n_bent = crowd.n_bent(turn);
    std::int64_t n_alike = crowd.n_alike(turn);
    for (const auto& [to, arc] : crowd.arcs_to(other)) {
      const double bend = bends_.angle(face, arc, to);
      if (is_flat(bend, turn)) continue;
      --n_bent;
      if (!is_dull(bend, turn) && !is_sharper(bend, turn)) --n_alike;
    }
    return n_bent == n_alike && (n_alike <= 1 || surface_.n_sides(face) != 3);
  }

  bool continues_at_ends(Face from, std::int64_t arc, Face to) const {
    const int side = surface_.side(from, arc);
    const int n_sides = surface_.n_sides(from);
    const Corner first = surface_.corner_between(from, (side + n_sides - 1) % n_sides, side);
    const Corner second = surface_.corner_between(from, side, (side + 1) % n_sides);
    return continues_at(first, from, to) && continues_at(second, from, to);
  }

  bool continues_at(Corner corner, Face from, Face to) const {
    return leads_to_another(corner, from, to) || leads_to_another(corner, to, from);
  }

  // Whether a walk around a corner crosses another sharp edge, or ends at the boundary or a
  // non-manifold edge. The walk begins with the step from `before` to `here`.
  bool leads_to_another(Corner corner, Face before, Face here) const {
    const Face start = before;
    for (int n_steps = 0; n_steps < kLongestFan && here != start; ++n_steps) {
      const Face next = surface_.next_around(corner, before, here);
      if (next == kNoCell) return true;
      const std::int64_t arc = arc_between(here, next);
      if (arc >= 0 && is_sharp_between_flats(here, arc, next)) return true;
      before = std::exchange(here, next);
    }
    return false;
  }

  const AnySurface& surface_;
  const Bends& bends_;
  const CrowdedFaces& crowded_;
};

}  // namespace superfacets
