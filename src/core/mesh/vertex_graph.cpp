#include "mesh/vertex_graph.hpp"

#include <array>

#include "base/lists.hpp"
#include "base/prefetch.hpp"
#include "mesh/polygons.hpp"

namespace superfacets {
namespace {

// The neighbors of each vertex, ascending and without duplicates; see build_vertex_graph. `arcs` is
// empty, or as in smooth_positions. With arcs, faces that have an arc at each side take less time.
// If all faces have them, neighbors are not sorted.
Lists<Vertex> neighbors_of(const CornerLists& faces, std::span<const Vertex> representative,
                           std::span<const std::int64_t> arcs, ThreadTeam& team) {
  const auto add_sides = [=](std::int64_t begin, std::int64_t end, const auto& add) {
    for (std::int64_t face = begin; face < end; ++face) {
      const auto corners = faces[face];
      // The other face at each side adds the opposite direction.
      const bool is_inside = !arcs.empty() && arcs[face + 1] - arcs[face] == std::ssize(corners);
      Vertex a = representative[corners.back()];
      for (const Vertex corner : corners) {
        const Vertex b = representative[corner];
        if (a != b) add(a, b);
        if (a != b && !is_inside) add(b, a);
        a = b;
      }
    }
  };
  auto neighbors = group<Vertex>(faces.n_cells(), std::ssize(representative), add_sides, team);
  if (arcs.empty() || arcs.back() < std::ssize(faces.corners)) sort_unique(neighbors, team);
  return neighbors;
}

constexpr std::int64_t kAhead = 48;  // neighbors are prefetched this number of neighbors in advance
constexpr std::array kFactors{0.5, -0.53};  // of the two moves of a step; see smooth_positions
constexpr double kMaxError = 1e-5;          // of the response of all steps

// The coefficients of a series g of Chebyshev polynomials T_j(k - 1), 0 <= k <= 2, so that n_steps
// steps multiply waves of frequency k by 1 + k g(k). The series is cut as kMaxError permits.
std::vector<double> series_of(int n_steps) {
  const std::size_t n = 2 * static_cast<std::size_t>(n_steps);
  std::vector<double> series(n);
  for (std::size_t move = 0; move < n; ++move) {
    const std::vector<double> before = series;
    for (std::size_t j = 0; j < n; ++j) {
      // g becomes g - factor * (1 + g + x g), where x = k - 1, x T_0 = T_1, and otherwise
      // x T_j = (T_(j-1) + T_(j+1)) / 2. The 1 is added as 2 / 2.
      const double below = j > 0 ? before[j - 1] * (j > 1 ? 1.0 : 2.0) : 2.0;
      const double above = j + 1 < n ? before[j + 1] : 0.0;
      series[j] -= kFactors[move % 2] * (before[j] + (below + above) / 2.0);
    }
  }
  double error = 0.0;
  while ((error += 2.0 * std::abs(series.back())) <= kMaxError) series.pop_back();
  return series;
}

// A displacement x, y, z of a vertex. Four numbers fill a vector register.
struct alignas(16) Shift {
  std::array<float, 4> numbers;

  Shift operator+(const Shift& other) const {
    Shift sum;
    for (int i = 0; i < 4; ++i) sum.numbers[i] = numbers[i] + other.numbers[i];
    return sum;
  }
  Shift operator*(float factor) const {
    Shift product;
    for (int i = 0; i < 4; ++i) product.numbers[i] = factor * numbers[i];
    return product;
  }
};

}  // namespace

VertexGraph build_vertex_graph(std::span<const Point> vertices, const CornerLists& faces,
                               std::span<const Vertex> representative, ThreadTeam& team) {
  SUPERFACETS_ASSERT(representative.size() == vertices.size());
  Lists<Vertex> arcs = neighbors_of(faces, representative, {}, team);
  Buffer<double> lengths(arcs.entries.size());
  team.for_each_index(arcs.n_lists(), [&](std::int64_t vertex) {
    for (std::int64_t arc = arcs.offsets[vertex]; arc < arcs.offsets[vertex + 1]; ++arc) {
      lengths[arc] = norm(vertices[arcs.entries[arc]] - vertices[vertex]);
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

Buffer<Point> smooth_positions(std::span<const Point> vertices, const CornerLists& faces,
                               std::span<const Vertex> representative,
                               std::span<const std::int64_t> arcs, int n_steps, ThreadTeam& team) {
  SUPERFACETS_ASSERT(representative.size() == vertices.size() && n_steps > 0);
  const auto n = std::ssize(vertices);
  const std::vector<double> series = series_of(n_steps);
  const Lists<Vertex> neighbors = neighbors_of(faces, representative, arcs, team);
  Buffer<Shift> bumps(n);
  Buffer<Shift> sums(n);
  Buffer<Shift> older(n);
  team.for_each_index(n, [&](std::int64_t vertex) {
    Point sum{0.0, 0.0, 0.0};
    for (const Vertex neighbor : neighbors[vertex]) sum = sum + vertices[neighbor];
    const auto size = static_cast<double>(neighbors[vertex].size());
    const Point bump = size > 0.0 ? vertices[vertex] - (1.0 / size) * sum : sum;
    bumps[vertex] = {
        {static_cast<float>(bump.x), static_cast<float>(bump.y), static_cast<float>(bump.z), 0.0F}};
    sums[vertex] = bumps[vertex] * static_cast<float>(series.back());
    older[vertex] = Shift{};
  });
  const auto n_entries = std::ssize(neighbors.entries);
  for (std::ptrdiff_t j = std::ssize(series) - 2; j >= 0; --j) {  // Clenshaw's recurrence
    const auto coefficient = static_cast<float>(series[j]);
    team.for_each_index(n, [&, entries = neighbors.entries.data()](std::int64_t vertex) {
      const std::int64_t begin = neighbors.offsets[vertex];
      const std::int64_t end = neighbors.offsets[vertex + 1];
      Shift sum{};
      for (std::int64_t i = begin; i < end; ++i) {
        if (i + kAhead < n_entries) prefetch(&sums[entries[i + kAhead]]);
        sum = sum + sums[entries[i]];
      }
      const float factor =
          (j > 0 ? -2.0F : -1.0F) / static_cast<float>(std::max(end - begin, std::int64_t{1}));
      older[vertex] = bumps[vertex] * coefficient + sum * factor + older[vertex] * -1.0F;
    });
    std::swap(sums, older);
  }
  bumps = Buffer<Shift>();
  older = Buffer<Shift>();
  Buffer<Point> smoothed(n);  // reuses their memory
  team.for_each_index(n, [&](std::int64_t vertex) {
    const Vertex lowest = representative[vertex];
    const auto& [x, y, z, unused] = sums[lowest].numbers;
    smoothed[vertex] = vertices[lowest] + Point{x, y, z};
  });
  return smoothed;
}

}  // namespace superfacets
