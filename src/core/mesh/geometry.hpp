// Stage 0: centroids, areas and normals of faces, and the volume that faces enclose.
#pragma once

#include <array>

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"

namespace superfacets {

inline std::array<Point, 3> corners_of(std::span<const Point> vertices, const Triangle& face) {
  const auto& [a, b, c] = face.corners;
  return {vertices[a], vertices[b], vertices[c]};
}

inline Point centroid(std::span<const Point> vertices, const Triangle& face) {
  const auto& [a, b, c] = face.corners;
  const Point sum = vertices[a] + vertices[b] + vertices[c];
  return {sum.x / 3.0, sum.y / 3.0, sum.z / 3.0};
}

// Twice the area times the unit normal of a face; zero if the face has no area.
inline Point double_area_vector(std::span<const Point> vertices, const Triangle& face) {
  const auto& [a, b, c] = face.corners;
  return cross(vertices[b] - vertices[a], vertices[c] - vertices[a]);
}

inline double area(std::span<const Point> vertices, const Triangle& face) {
  return 0.5 * norm(double_area_vector(vertices, face));
}

// Centroids and areas of faces, as needed by stages 1 and 2.
struct FaceShapes {
  Buffer<Point> centroids;  // (F,) centroid of each face
  Buffer<double> areas;     // (F,) area of each face
  // (F / kSumBlock, rounded up) squared length of the longest side in each block of kSumBlock faces
  Buffer<double> longest;
};

// Computes all measures in one pass over the faces.
FaceShapes measure_faces(std::span<const Point> vertices, std::span<const Triangle> faces,
                         ThreadTeam& team);

// Total area of slivers. A sliver is a face whose longest side is longer than min_length, and whose
// height above this side is less than max_height. The result has the same bits for any number of
// threads. `longest` is the member of FaceShapes. It is used to skip blocks without long sides.
double sliver_area(std::span<const Point> vertices, std::span<const Triangle> faces,
                   std::span<const double> areas, std::span<const double> longest,
                   double min_length, double max_height, ThreadTeam& team);

// Area times unit normal of each face.
Buffer<Point> area_vectors(std::span<const Point> vertices, std::span<const Triangle> faces,
                           ThreadTeam& team);

// Normalizes a cross product. Returns zero if the product is not longer than its rounding errors.
// longest_squared must be at least the squared lengths of both multiplied vectors.
Point unit_normal_along(const Point& direction, double longest_squared);

// Unit normal of a face. Returns zero if the face has no normal, because two corners are at the
// same position or its area is not larger than rounding errors.
Point unit_normal(std::span<const Point> vertices, const Triangle& face);

// Writes the unit normals of faces, with the same bits as unit_normal.
void write_unit_normals(std::span<const Point> vertices, std::span<const Triangle> faces,
                        std::span<Point> normals);

// Unit normal of each face; also as (3 F,) numbers in single precision.
Buffer<Point> unit_normals(std::span<const Point> vertices, std::span<const Triangle> faces,
                           ThreadTeam& team);
Buffer<float> single_normals(std::span<const Point> vertices, std::span<const Triangle> faces,
                             ThreadTeam& team);

// Number of faces that have no normal.
std::int64_t count_degenerate(std::span<const Point> vertices, std::span<const Triangle> faces);

// Mean of one or more positions with weights >= 0; the first position if all weights are 0. The
// result has the same bits for any number of threads.
Point weighted_mean(std::span<const Point> positions, std::span<const double> weights,
                    ThreadTeam& team);

// Volume enclosed by the faces of a closed mesh, negative if their normals point inwards. `origin`
// should be near the mesh. The result has the same bits for any number of threads.
double signed_volume(std::span<const Point> vertices, std::span<const Triangle> faces, Point origin,
                     ThreadTeam& team);

}  // namespace superfacets
