// Basic types of the core. Kernels take arrays and return arrays. Kernels print nothing and do not
// depend on Python. The Python package checks the arguments (superfacets/base/checks.py).
#pragma once

#include <cmath>
#include <compare>
#include <cstdint>
#include <span>
#include <vector>

namespace superfacets {

using Vertex = std::int32_t;
using Face = std::int32_t;
using Cell = std::int32_t;         // index of a face, point, tetrahedron or node of another graph
using Place = std::int32_t;        // index of a cell in the order of a space-filling curve
using Label = std::int32_t;        // region of a cell, 0..K-1
using PathLength = std::uint64_t;  // sum of quantized arc lengths, an integer

inline constexpr Cell kNoCell = -1;
inline constexpr Place kNoPlace = -1;
inline constexpr Label kNoLabel = -1;

struct Point {
  double x, y, z;

  auto operator<=>(const Point&) const = default;  // by x, then y, then z
};
static_assert(sizeof(Point) == 3 * sizeof(double),
              "a Point must have the memory layout of a row of an (N, 3) array");

struct Triangle {
  Vertex corners[3];
};
static_assert(sizeof(Triangle) == 3 * sizeof(Vertex),
              "a Triangle must have the memory layout of a row of an (F, 3) array");

// The next corner of a triangle, in cyclic order. Side s runs from corner s to the next corner.
constexpr int next_corner(int corner) {
  return corner == 2 ? 0 : corner + 1;
}
constexpr int previous_corner(int corner) {
  return corner == 0 ? 2 : corner - 1;
}

struct Tet {
  Vertex corners[4];
};
static_assert(sizeof(Tet) == 4 * sizeof(Vertex),
              "a Tet must have the memory layout of a row of an (N, 4) array");

inline Point operator+(const Point& a, const Point& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline Point operator-(const Point& a, const Point& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline Point operator*(double s, const Point& a) {
  return {s * a.x, s * a.y, s * a.z};
}
inline double dot(const Point& a, const Point& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline double squared_norm(const Point& a) {
  return dot(a, a);
}
inline double norm(const Point& a) {
  return std::sqrt(squared_norm(a));
}
inline Point cross(const Point& a, const Point& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

}  // namespace superfacets
