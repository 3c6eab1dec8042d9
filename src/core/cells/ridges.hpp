// Ridges: convex edges on which a surface bends at once, as on machine parts. On a rounded limb it
// bends a little at each of many edges.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "cells/arcs.hpp"

namespace superfacets {

// What a ridge bends by at least: 40 degrees, so that both edges of a chamfer of 45 count. Edges of
// rounded limbs bend by less on all but coarse meshes.
inline constexpr double kSharpAngle = std::numbers::pi * 2.0 / 9.0;

// A little more than the cosine of that: an edge whose normals have more is not sharp.
inline constexpr double kSharpCosine = 0.7661;

// An edge that bends by less than this share of a ridge is flat beside it.
inline constexpr double kFlatShare = 0.3;

// Of two edges that are alike, the duller bends by at least this share of the sharper.
inline constexpr double kAlikeShare = 0.7;

// Whether a face is flat beside an edge to another that bends by `turn`: all its further edges are
// flat, but for those that are sharp alike, as at the corner of a box. A triangle must have a flat
// one then, so that not all edges of a coarse ball are ridges; a polygon is flat inside.
// bend_of(face, arc, to) is the angle at an arc, concave or convex, 0 to pi.
template <typename BendOf>
bool is_flat_beside(const Arcs& arcs, Face face, Face other, double turn, int n_sides,
                    const BendOf& bend_of) {
  int n_sharp = 0;
  for (const auto [arc, to] : arcs.steps(face)) {
    if (to == other) continue;
    const double bend = bend_of(face, arc, to);
    if (bend < kFlatShare * turn) continue;
    const double least = std::max(kSharpAngle, kAlikeShare * turn);
    if (bend < least || turn < kAlikeShare * bend || (n_sides == 3 && ++n_sharp > 1)) return false;
  }
  return true;
}

// Whether two faces meet at a ridge, if they meet at a convex edge that bends by `turn`: by
// kSharpAngle or more, where both faces are flat beside it. The same for both arcs of a pair.
template <typename BendOf, typename SidesOf>
bool is_ridge(const Arcs& arcs, Face from, Face to, double turn, const BendOf& bend_of,
              const SidesOf& n_sides_of) {
  return turn >= kSharpAngle && is_flat_beside(arcs, from, to, turn, n_sides_of(from), bend_of) &&
         is_flat_beside(arcs, to, from, turn, n_sides_of(to), bend_of);
}

}  // namespace superfacets
