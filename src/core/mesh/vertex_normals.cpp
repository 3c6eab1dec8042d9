#include "mesh/vertex_normals.hpp"

#include <vector>

#include "base/assert.hpp"
#include "mesh/geometry.hpp"

namespace superfacets {
namespace {

class Means {
 public:
  explicit Means(std::span<const Vertex> representative)
      : representative_(representative),
        means_(representative.size()),
        n_faces_(representative.size()) {
    std::ranges::fill(means_, Point{0.0, 0.0, 0.0});
  }

  void add(std::span<const Vertex> corners, const Point& normal) {
    for (const Vertex corner : corners) {
      const Vertex vertex = representative_[corner];
      means_[vertex] = means_[vertex] + normal;
      ++n_faces_[vertex];
    }
  }

  Buffer<Point> take() && {
    for (std::size_t vertex = 0; vertex < means_.size(); ++vertex) {
      const double n_faces = std::max(n_faces_[vertex], 1);
      const Point& sum = means_[vertex];
      means_[vertex] = {sum.x / n_faces, sum.y / n_faces, sum.z / n_faces};
    }
    return std::move(means_);
  }

 private:
  std::span<const Vertex> representative_;
  Buffer<Point> means_;  // sums, until they are taken
  std::vector<int> n_faces_;
};

}  // namespace

Buffer<Point> mean_normals(std::span<const Point> vertices, std::span<const Triangle> faces,
                           std::span<const Vertex> representative) {
  SUPERFACETS_ASSERT(representative.size() == vertices.size());
  Means means(representative);
  for (const Triangle& face : faces) means.add(face.corners, unit_normal(vertices, face));
  return std::move(means).take();
}

Buffer<Point> mean_normals(std::span<const Point> vertices, const Polygons& faces,
                           std::span<const Vertex> representative) {
  SUPERFACETS_ASSERT(representative.size() == vertices.size());
  Means means(representative);
  for (Face face = 0; face < faces.n_faces(); ++face) {
    means.add(faces[face], measure_polygon(vertices, faces[face]).normal);
  }
  return std::move(means).take();
}

}  // namespace superfacets
