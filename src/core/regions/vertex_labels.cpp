#include "regions/vertex_labels.hpp"

#include <functional>
#include <queue>
#include <tuple>

#include "base/lists.hpp"
#include "base/radix_sort.hpp"

namespace superfacets {
namespace {

std::vector<std::int64_t> sizes_of(std::span<const Label> labels, const LeastSize& size) {
  SUPERFACETS_ASSERT(size.counts.size() == labels.size());
  std::vector<std::int64_t> sizes(size.n_labels);
  for (std::size_t vertex = 0; vertex < labels.size(); ++vertex) {
    if (labels[vertex] != kNoLabel) sizes[labels[vertex]] += size.counts[vertex];
  }
  return sizes;
}

// Regions of vertices, in which small regions take vertices from other regions.
class GrowingRegions {
 public:
  GrowingRegions(const VertexEdges& edges, std::span<const Label> labels, const LeastSize& size)
      : edges_(edges),
        size_(size),
        labels_(copy_of(labels)),
        sizes_(sizes_of(labels, size)),
        seen_(labels.size()) {}

  void grow_all() {
    std::vector<std::vector<Vertex>> members(sizes_.size());  // vertices of each small region
    for (Vertex vertex = 0; vertex < edges_.n_vertices(); ++vertex) {
      const Label label = labels_[vertex];
      if (label != kNoLabel && is_small(label)) members[label].push_back(vertex);
    }
    for (Label label = 0; label < size_.n_labels; ++label) grow(label, members[label]);
  }

  Buffer<Label> take() && { return std::move(labels_); }

 private:
  struct Step {
    double weight;
    Vertex to;
    auto operator<=>(const Step&) const = default;
  };
  using Steps = std::priority_queue<Step, std::vector<Step>, std::greater<>>;

  // Maximum number of vertices visited to test whether a region stays connected without a vertex. A
  // small number suffices, because the neighbors of a vertex are mostly adjacent to each other, or
  // share a neighbor.
  static constexpr std::size_t kMaxVisited = 100;

  bool is_small(Label label) const { return sizes_[label] < size_.least; }

  void grow(Label label, std::span<const Vertex> members) {
    Steps steps;
    // the moved vertices, and the previous region of each
    std::vector<std::pair<Vertex, Label>> taken;
    for (const Vertex member : members) add_steps(member, steps);
    while (is_small(label) && !steps.empty()) {
      const Vertex vertex = steps.top().to;
      steps.pop();
      const Label giver = labels_[vertex];
      if (giver == label || giver == kNoLabel) continue;
      if (sizes_[giver] - size_.counts[vertex] < size_.least || !can_spare(vertex)) continue;
      move(vertex, label);
      taken.emplace_back(vertex, giver);
      add_steps(vertex, steps);
    }
    if (!is_small(label)) return;
    for (const auto& [vertex, giver] : taken) move(vertex, giver);
  }

  void move(Vertex vertex, Label to) {
    sizes_[labels_[vertex]] -= size_.counts[vertex];
    sizes_[to] += size_.counts[vertex];
    labels_[vertex] = to;
  }

  void add_steps(Vertex from, Steps& steps) const {
    for (const Vertex to : edges_.of(from)) {
      if (labels_[to] != labels_[from]) steps.push({edges_.weight(from, to), to});
    }
  }

  // Whether the neighbors of a vertex in its region stay connected without the vertex, as far as a
  // search of limited length can show.
  bool can_spare(Vertex vertex) {
    const Label label = labels_[vertex];
    if (edges_.of(vertex).size() > kMaxVisited)
      return false;  // the search would not reach all neighbors
    std::size_t n_missing = 0;
    Vertex first = -1;
    for (const Vertex neighbor : edges_.of(vertex)) {
      if (labels_[neighbor] != label) continue;
      if (n_missing++ == 0) first = neighbor;
    }
    if (n_missing < 2) return true;
    ++search_;
    seen_[vertex] = search_;
    seen_[first] = search_;
    std::vector<Vertex> visited{first};
    for (std::size_t next = 0; next < visited.size() && next < kMaxVisited; ++next) {
      for (const Vertex neighbor : edges_.of(visited[next])) {
        // Every edge has arcs in both directions, so each neighbor of the vertex is found exactly
        // once.
        if (neighbor == vertex && --n_missing == 0) return true;
        if (labels_[neighbor] != label || seen_[neighbor] == search_) continue;
        seen_[neighbor] = search_;
        visited.push_back(neighbor);
      }
    }
    return false;
  }

  const VertexEdges& edges_;
  const LeastSize& size_;
  Buffer<Label> labels_;
  std::vector<std::int64_t> sizes_;
  std::vector<std::int64_t> seen_;  // number of the last search that reached each vertex; 0 if none
  std::int64_t search_ = 0;
};

}  // namespace

Buffer<Label> spread_labels(const VertexEdges& edges, std::span<const Label> labels,
                            std::span<const Label> hints, const AllowedLabels& allowed) {
  SUPERFACETS_ASSERT(std::cmp_equal(labels.size(), edges.n_vertices()) &&
                     hints.size() == labels.size());
  const auto is_later = [](const WeightedEdge& left, const WeightedEdge& right) {
    return std::tie(left.key, left.a, left.b) > std::tie(right.key, right.a, right.b);
  };
  std::priority_queue<WeightedEdge, std::vector<WeightedEdge>, decltype(is_later)> steps(is_later);
  Buffer<Label> spread = copy_of(labels);
  const auto add_steps = [&](Vertex from) {
    for (const Vertex to : edges.of(from)) {
      if (spread[to] != kNoLabel || !allowed.contain(to, spread[from])) continue;
      const std::uint64_t differs = hints[from] == hints[to] ? 0 : 1;
      steps.push({ascending_bits(edges.weight(from, to)) << 1 | differs, to, from});
    }
  };
  for (Vertex vertex = 0; vertex < edges.n_vertices(); ++vertex) {
    if (labels[vertex] != kNoLabel) add_steps(vertex);
  }
  while (!steps.empty()) {
    const auto [key, to, from] = steps.top();
    steps.pop();
    if (spread[to] != kNoLabel) continue;
    spread[to] = spread[from];
    add_steps(to);
  }
  return spread;
}

Buffer<Label> grow_small_regions(const VertexEdges& edges, std::span<const Label> labels,
                                 const LeastSize& size) {
  GrowingRegions regions(edges, labels, size);
  regions.grow_all();
  return std::move(regions).take();
}

Buffer<Label> merge_small_regions(const VertexEdges& edges, std::span<const Label> labels,
                                  const LeastSize& size) {
  ThreadTeam team(1);
  const auto add_edges = [&](Vertex a, std::vector<WeightedEdge>& list) {
    for (const Vertex b : edges.of(a)) {
      if (a >= b || labels[a] == labels[b]) continue;
      list.push_back({ascending_bits(edges.weight(a, b)), labels[a], labels[b]});
    }
  };
  Buffer<WeightedEdge> ascending = gather<WeightedEdge>(edges.n_vertices(), add_edges, team);
  radix_sort(ascending);
  std::vector<std::int64_t> sizes = sizes_of(labels, size);
  DisjointSets sets(size.n_labels);
  join_small_sets(ascending.span(), size.least, sets, sizes);
  Buffer<Label> merged = copy_of(labels);
  for (Label& label : merged) {
    if (label != kNoLabel) label = sets.root(label);
  }
  return merged;
}

}  // namespace superfacets
