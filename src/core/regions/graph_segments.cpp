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

}  // namespace

Buffer<Cell> graph_segments(std::span<const Point> positions, std::span<const Point> normals,
                            std::span<const Vertex> ends, const SegmentLimits& limits,
                            ThreadTeam& team) {
  SUPERFACETS_ASSERT(normals.size() == positions.size() && all_below(ends, positions.size()));
  Buffer<WeightedEdge> edges(ends.size() / 2);
  team.for_each_index(std::ssize(edges), [&](std::int64_t edge) {
    edges[edge] = weighted(positions, normals, ends[2 * edge], ends[2 * edge + 1]);
  });
  radix_sort(edges);
  std::vector<std::int64_t> sizes(positions.size(), 1);  // number of nodes, at the root of each set
  DisjointSets sets(positions.size());
  join_below_limits(edges.span(), limits.threshold, sets, sizes);
  join_small_sets(edges.span(), limits.least, sets, sizes);
  return std::move(sets).number().of;
}

}  // namespace superfacets
