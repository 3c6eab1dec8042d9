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

// A little more than the cosine of that angle: what lies above it need not be looked at.
inline constexpr double kSharpCosine = 0.7661;

// An edge that bends by less than this share of a ridge is flat beside it.
inline constexpr double kFlatShare = 0.3;

// Of two edges that are alike, the duller bends by at least this share of the sharper.
inline constexpr double kAlikeShare = 0.7;

// Whether a face is flat beside an edge to another that bends by `turn`: all its further edges are
// flat, but for those that are sharp alike, as at the corner of a box. A triangle must have a flat
// one then, so that not all edges of a coarse ball are ridges; a polygon is flat inside.
// angle_of(face, arc, to) is the signed angle at an arc.
template <typename AngleOf>
bool is_flat_beside(const Arcs& arcs, Face face, Face other, double turn, int n_sides,
                    const AngleOf& angle_of) {
  int n_sharp = 0;
  for (const auto [arc, to] : arcs.steps(face)) {
    if (to == other) continue;
    const double bend = std::abs(angle_of(face, arc, to));
    if (bend < kFlatShare * turn) continue;
    const double least = std::max(kSharpAngle, kAlikeShare * turn);
    if (bend < least || turn < kAlikeShare * bend || (n_sides == 3 && ++n_sharp > 1)) return false;
  }
  return true;
}

// Whether an arc crosses a ridge: a convex edge that bends by kSharpAngle or more between two faces
// that are flat beside it. The same for both arcs of a pair.
template <typename AngleOf, typename SidesOf>
bool is_ridge(const Arcs& arcs, Face from, std::int64_t arc, const AngleOf& angle_of,
              const SidesOf& n_sides_of) {
  const Face to = arcs.targets[arc];
  const double angle = angle_of(from, arc, to);
  if (angle > -kSharpAngle) return false;
  return is_flat_beside(arcs, from, to, -angle, n_sides_of(from), angle_of) &&
         is_flat_beside(arcs, to, from, -angle, n_sides_of(to), angle_of);
}

}  // namespace superfacets
