// Stage 0: what the corners of faces tell: centroids, areas, normals, and the volume they enclose.
#pragma once

#include "base/threads.hpp"
#include "base/types.hpp"

namespace superfacets {

// Centroids and areas of faces: the positions and measures of their cells.
void measure_faces(std::span<const Point> vertices, std::span<const Triangle> faces,
                   ThreadTeam& team, std::span<Point> centroids, std::span<double> areas);

// Area times unit normal of each face; zero where a face has no area.
void area_vectors(std::span<const Point> vertices, std::span<const Triangle> faces,
                  ThreadTeam& team, std::span<Point> vectors);

// The unit normal of a face, or a zero vector where it has none: two corners at one position, or no
// area beyond rounding errors.
Point unit_normal(std::span<const Point> vertices, const Triangle& face);

// Faces that have no normal.
std::int64_t count_degenerate(std::span<const Point> vertices, std::span<const Triangle> faces);

// Volume enclosed by the faces, negative if they are turned inwards. Means something on closed
// meshes only. `origin` should be near the mesh. The same bits on any number of threads.
double signed_volume(std::span<const Point> vertices, std::span<const Triangle> faces, Point origin,
                     ThreadTeam& team);

}  // namespace superfacets
