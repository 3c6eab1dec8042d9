#include "mesh/vertex_normals.hpp"

#include "mesh/polygons.hpp"

namespace superfacets {

Buffer<Point> mean_normals(std::span<const Point> vertices, const CornerLists& faces,
                           std::span<const Vertex> representative) {
  SUPERFACETS_ASSERT(representative.size() == vertices.size());
  Buffer<Point> means(vertices.size());  // first the sums of normals, then the means
  std::vector<int> n_faces(vertices.size());
  std::ranges::fill(means, Point{0.0, 0.0, 0.0});
  for (Face face = 0; face < faces.n_cells(); ++face) {
    const Point normal = unit_normal(vertices, faces[face]);
    for (const Vertex corner : faces[face]) {
      const Vertex vertex = representative[corner];
      means[vertex] = means[vertex] + normal;
      ++n_faces[vertex];
    }
  }
  for (std::size_t vertex = 0; vertex < means.size(); ++vertex) {
    const double n = std::max(n_faces[vertex], 1);
    means[vertex] = {means[vertex].x / n, means[vertex].y / n, means[vertex].z / n};
  }
  return means;
}

}  // namespace superfacets
