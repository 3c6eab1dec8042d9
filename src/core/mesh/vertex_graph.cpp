#include "mesh/vertex_graph.hpp"

#include <algorithm>

#include "base/assert.hpp"

namespace superfacets {
namespace {

// Calls visit(a, b) for each side of a face with the representatives of its ends, if they differ.
template <typename Visit>
void visit_sides(std::span<const Vertex> corners, std::span<const Vertex> representative,
                 const Visit& visit) {
  for (std::size_t side = 0; side < corners.size(); ++side) {
    const Vertex a = representative[corners[side]];
    const Vertex b = representative[corners[side + 1 == corners.size() ? 0 : side + 1]];
    if (a != b) visit(a, b);
  }
}

template <typename Visit>
void for_each_side(std::span<const Triangle> faces, std::span<const Vertex> representative,
                   const Visit& visit) {
  for (const Triangle& face : faces) visit_sides(face.corners, representative, visit);
}

template <typename Visit>
void for_each_side(const Polygons& faces, std::span<const Vertex> representative,
                   const Visit& visit) {
  for (Face face = 0; face < faces.n_faces(); ++face) {
    visit_sides(faces[face], representative, visit);
  }
}

void sort_rows(VertexGraph& graph, ThreadTeam& team) {
  const auto n_vertices = static_cast<std::int64_t>(graph.offsets.size()) - 1;
  team.for_each_index(n_vertices, [&](std::int64_t vertex) {
    std::sort(graph.neighbors.data() + graph.offsets[vertex],
              graph.neighbors.data() + graph.offsets[vertex + 1]);
  });
}

// Removes duplicates from the sorted rows, and closes the gaps.
void drop_repeated(VertexGraph& graph) {
  std::int64_t n_kept = 0;
  for (std::size_t vertex = 0; vertex + 1 < graph.offsets.size(); ++vertex) {
    const std::int64_t begin = graph.offsets[vertex];
    const std::int64_t end = graph.offsets[vertex + 1];
    graph.offsets[vertex] = n_kept;
    Vertex last = -1;
    for (std::int64_t arc = begin; arc < end; ++arc) {
      const Vertex neighbor = graph.neighbors[arc];
      if (neighbor != last) graph.neighbors[n_kept++] = neighbor;
      last = neighbor;
    }
  }
  graph.offsets[graph.offsets.size() - 1] = n_kept;
  Buffer<Vertex> kept(n_kept);
  std::copy_n(graph.neighbors.data(), n_kept, kept.data());
  graph.neighbors = std::move(kept);
}

void measure_edges(std::span<const Point> vertices, ThreadTeam& team, VertexGraph& graph) {
  graph.lengths = Buffer<double>(graph.neighbors.size());
  const auto n_vertices = static_cast<std::int64_t>(vertices.size());
  team.for_each_index(n_vertices, [&](std::int64_t vertex) {
    for (std::int64_t arc = graph.offsets[vertex]; arc < graph.offsets[vertex + 1]; ++arc) {
      // Computed from the lower to the higher vertex, so that both directions have the same bits.
      const std::int64_t neighbor = graph.neighbors[arc];
      const auto [low, high] = std::minmax({vertex, neighbor});
      graph.lengths[arc] = norm(vertices[high] - vertices[low]);
    }
  });
}

template <typename Faces>
VertexGraph build_graph(std::span<const Point> vertices, const Faces& faces,
                        std::span<const Vertex> representative, ThreadTeam& team) {
  const std::size_t n_vertices = representative.size();
  SUPERFACETS_ASSERT(vertices.size() == n_vertices);
  VertexGraph graph{Buffer<std::int64_t>(n_vertices + 1), {}, {}};
  std::ranges::fill(graph.offsets, 0);
  for_each_side(faces, representative, [&](Vertex a, Vertex b) {
    ++graph.offsets[a];
    ++graph.offsets[b];
  });
  std::int64_t n_arcs = 0;
  for (std::int64_t& offset : graph.offsets) {  // counts become ends of rows, then cursors
    n_arcs += offset;
    offset = n_arcs;
  }
  graph.neighbors = Buffer<Vertex>(n_arcs);
  for_each_side(faces, representative, [&](Vertex a, Vertex b) {
    graph.neighbors[--graph.offsets[a]] = b;
    graph.neighbors[--graph.offsets[b]] = a;
  });
  sort_rows(graph, team);
  drop_repeated(graph);
  measure_edges(vertices, team, graph);
  return graph;
}

}  // namespace

VertexGraph build_vertex_graph(std::span<const Point> vertices, std::span<const Triangle> faces,
                               std::span<const Vertex> representative, ThreadTeam& team) {
  return build_graph(vertices, faces, representative, team);
}

VertexGraph build_vertex_graph(std::span<const Point> vertices, const Polygons& faces,
                               std::span<const Vertex> representative, ThreadTeam& team) {
  return build_graph(vertices, faces, representative, team);
}

}  // namespace superfacets
