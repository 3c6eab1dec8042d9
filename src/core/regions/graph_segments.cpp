#include "regions/graph_segments.hpp"

#include "base/radix_sort.hpp"
#include "regions/vertex_edges.hpp"

namespace superfacets {
namespace {

WeightedEdge weighted(std::span<const Point> positions, std::span<const Point> normals, Vertex a,
                      Vertex b) {
  const bool is_convex = dot(normals[b], positions[b] - positions[a]) > 0.0;
  return {ascending_bits(crease_weight(normals[a], normals[b], is_convex)), a, b};
}

// Visits edges in ascending order of weight, and joins the two segments at the ends of an edge if
// its weight is within the limits of both segments.
void join_below_limits(std::span<const WeightedEdge> edges, double threshold, DisjointSets& sets,
                       std::span<std::int64_t> sizes) {
  std::vector<double> limits(sizes.size(), threshold);  // limit of each segment, at its root
  for (const WeightedEdge& edge : edges) {
    const Cell a = sets.root(edge.a);
    const Cell b = sets.root(edge.b);
    const auto weight = std::bit_cast<double>(edge.key);
    if (a == b || weight > limits[a] || weight > limits[b]) continue;
    const std::int64_t size = sizes[a] + sizes[b];
    const Cell root = sets.unite(a, b);
    sizes[root] = size;
    limits[root] = weight + threshold / static_cast<double>(size);
  }
}

// Sorts the edges, and joins the nodes of each segment. `sizes` is the number of nodes of each
// segment, at its root, and is 1 for each node before the call.
DisjointSets joined_nodes(Buffer<WeightedEdge>& edges, const SegmentLimits& limits,
                          std::span<std::int64_t> sizes) {
  radix_sort(edges);
  DisjointSets sets(sizes.size());
  join_below_limits(edges.span(), limits.threshold, sets, sizes);
  join_small_sets(edges.span(), limits.least, sets, sizes);
  return sets;
}

std::int64_t count_segments(Buffer<WeightedEdge> edges, std::size_t n_nodes,
                            const SegmentLimits& limits) {
  std::vector<std::int64_t> sizes(n_nodes, 1);
  DisjointSets sets = joined_nodes(edges, limits, sizes);
  std::int64_t n_segments = 0;
  for (const WeightedEdge& edge : edges) {
    std::int64_t& size = sizes[sets.root(edge.a)];  // set to 0 after the segment has been counted
    if (std::exchange(size, 0) >= limits.least) ++n_segments;
    if (std::exchange(sizes[sets.root(edge.b)], 0) >= limits.least) ++n_segments;
  }
  return n_segments;
}

Buffer<WeightedEdge> edges_of_mesh(std::span<const Point> positions, std::span<const Point> normals,
                                   std::span<const Triangle> faces,
                                   std::span<const Vertex> representative, ThreadTeam& team) {
  SUPERFACETS_ASSERT(normals.size() == positions.size());
  Buffer<WeightedEdge> edges(3 * faces.size());
  team.for_each_index(std::ssize(faces), [&](std::int64_t face) {
    const auto corner = [&](int i) { return representative[faces[face].corners[i]]; };
    edges[3 * face] = weighted(positions, normals, corner(0), corner(1));
    edges[3 * face + 1] = weighted(positions, normals, corner(0), corner(2));
    edges[3 * face + 2] = weighted(positions, normals, corner(2), corner(1));
  });
  return edges;
}

}  // namespace

std::int64_t count_graph_segments(std::span<const Point> positions, std::span<const Point> normals,
                                  std::span<const Vertex> ends, const SegmentLimits& limits,
                                  ThreadTeam& team) {
  SUPERFACETS_ASSERT(normals.size() == positions.size() && all_below(ends, positions.size()));
  Buffer<WeightedEdge> edges(ends.size() / 2);
  team.for_each_index(std::ssize(edges), [&](std::int64_t edge) {
    edges[edge] = weighted(positions, normals, ends[2 * edge], ends[2 * edge + 1]);
  });
  return count_segments(std::move(edges), positions.size(), limits);
}

Buffer<Vertex> mesh_segments(std::span<const Point> positions, std::span<const Point> normals,
                             std::span<const Triangle> faces,
                             std::span<const Vertex> representative, const SegmentLimits& limits,
                             ThreadTeam& team) {
  Buffer<WeightedEdge> edges = edges_of_mesh(positions, normals, faces, representative, team);
  std::vector<std::int64_t> sizes(positions.size(), 1);
  DisjointSets sets = joined_nodes(edges, limits, sizes);
  Buffer<Vertex> segments(positions.size());
  for (std::size_t vertex = 0; vertex < segments.size(); ++vertex) {
    segments[vertex] = sets.root(representative[vertex]);
  }
  return segments;
}

}  // namespace superfacets
