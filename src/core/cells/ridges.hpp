// Ridges: convex edges on which a surface bends at once, as on machine parts. On a rounded limb it
// bends a little at each of many edges.
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>

#include "cells/surface.hpp"
#include "cells/weights.hpp"

namespace superfacets {

// A little more than the cosine of kSharpAngle: an edge whose normals have more is not sharp.
inline constexpr double kSharpCosine = 0.7661;

// An edge that bends by less than this share of a ridge is flat beside it.
inline constexpr double kFlatShare = 0.3;

// Of two edges that are alike, the duller bends by at least this share of the sharper.
inline constexpr double kAlikeShare = 0.7;

// Finds the ridges of a surface of faces: convex edges that bend by kSharpAngle or more between two
// faces that are flat beside them, and that go on: at each of their ends they meet another such
// edge, or the border of the surface. Two faces that share several edges have none.
//
// Bends are two functions: bends.angle(face, arc, to) is the angle at an arc, concave or convex, 0
// to pi; bends.is_convex(face, arc, to).
template <typename AnySurface, typename Bends>
class Ridges {
 public:
  Ridges(const AnySurface& surface, const Bends& bends) : surface_(surface), bends_(bends) {}

  // Whether an arc crosses a ridge. The same for both arcs of a pair.
  bool crosses(Face from, std::int64_t arc) const {
    const Face to = surface_.arcs().targets[arc];
    if (!is_sharp_between_flats(from, arc, to)) return false;
    const std::int64_t back = arc_between(to, from);
    if (to < from && back >= 0) return continues_at_ends(to, back, from);
    return continues_at_ends(from, arc, to);
  }

 private:
  static constexpr int kLongestFan = 64;  // faces around a corner that are looked at

  // The arc from one face to another, or -1 if there is none, or more than one.
  std::int64_t arc_between(Face from, Face to) const {
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
    return turn >= kSharpAngle && bends_.is_convex(from, arc, to) && arc_between(from, to) >= 0 &&
           is_flat_beside(from, to, turn) && is_flat_beside(to, from, turn);
  }

  // Whether all further edges of a face are flat beside one that bends by `turn`, but for those
  // that are sharp alike, as at the corner of a box. A triangle must have a flat one then, so that
  // not all edges of a coarse ball are ridges; a polygon is flat inside.
  bool is_flat_beside(Face face, Face other, double turn) const {
    int n_sharp = 0;
    for (const auto [arc, to] : surface_.arcs().steps(face)) {
      if (to == other) continue;
      const double bend = bends_.angle(face, arc, to);
      if (bend < kFlatShare * turn) continue;
      const double least = std::max(kSharpAngle, kAlikeShare * turn);
      if (bend < least || turn < kAlikeShare * bend) return false;
      if (++n_sharp > 1 && surface_.n_sides(face) == 3) return false;
    }
    return true;
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

  // Whether a walk around a corner, to `here` after `before`, crosses another such edge or comes to
  // a border, or to an edge of more than two faces.
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
};

}  // namespace superfacets
