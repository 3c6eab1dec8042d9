#include "mesh/vertex_graph.hpp"

#include "base/lists.hpp"
#include "mesh/polygons.hpp"

namespace superfacets {
namespace {

// Calls visit(a, b) for each side of each face whose ends have different representatives a and b.
template <typename Visit>
void for_each_side(const CornerLists& faces, std::span<const Vertex> representative,
                   const Visit& visit) {
  for (Face face = 0; face < faces.n_cells(); ++face) {
    Vertex a = representative[faces[face].back()];
    for (const Vertex corner : faces[face]) {
      const Vertex b = representative[corner];
      if (a != b) visit(a, b);
      a = b;
    }
  }
}

}  // namespace

VertexGraph build_vertex_graph(std::span<const Point> vertices, const CornerLists& faces,
                               std::span<const Vertex> representative, ThreadTeam& team) {
  SUPERFACETS_ASSERT(vertices.size() == representative.size());
  Lists<Vertex> arcs = group<Vertex>(std::ssize(vertices), [&](const auto& add) {
    for_each_side(faces, representative, [&](Vertex a, Vertex b) {
      add(a, b);
      add(b, a);
    });
  });
  sort_unique(arcs, team);
  Buffer<double> lengths(arcs.entries.size());
  team.for_each_index(arcs.n_lists(), [&](std::int64_t vertex) {
    for (std::int64_t arc = arcs.offsets[vertex]; arc < arcs.offsets[vertex + 1]; ++arc) {
      // The length is computed from the lower to the higher vertex, so that both arcs of an edge
      // get bit-identical lengths.
      const std::int64_t neighbor = arcs.entries[arc];
      const auto [low, high] = std::minmax({vertex, neighbor});
      lengths[arc] = norm(vertices[high] - vertices[low]);
    }
  });
  return {std::move(arcs.offsets), std::move(arcs.entries), std::move(lengths)};
}

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

Buffer<Point> taubin_smooth(std::span<const Point> vertices, std::span<const std::int64_t> offsets,
                            std::span<const Vertex> neighbors, int n_steps, ThreadTeam& team) {
  SUPERFACETS_ASSERT(offsets.size() == vertices.size() + 1);
  Buffer<Point> now = copy_of(vertices);
  Buffer<Point> next(vertices.size());
  const auto move = [&](double factor) {
    team.for_each_index(std::ssize(vertices), [&](std::int64_t vertex) {
      next[vertex] = now[vertex];
      const std::int64_t n = offsets[vertex + 1] - offsets[vertex];
      if (n == 0) return;
      Point sum{0.0, 0.0, 0.0};
      for (const Vertex neighbor : neighbors.subspan(offsets[vertex], n)) sum = sum + now[neighbor];
      const Point mean = (1.0 / static_cast<double>(n)) * sum;
      next[vertex] = now[vertex] + factor * (mean - now[vertex]);
    });
    std::swap(now, next);
  };
  for (int step = 0; step < n_steps; ++step) {
    move(0.5);
    move(-0.53);
  }
  return now;
}

}  // namespace superfacets
