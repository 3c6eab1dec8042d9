#include "mesh/taubin.hpp"

#include <algorithm>
#include <utility>

#include "base/assert.hpp"

namespace superfacets {
namespace {

constexpr double kToward = 0.5;
constexpr double kAway = -0.53;

}  // namespace

Buffer<Point> taubin_smooth(std::span<const Point> vertices, std::span<const std::int64_t> offsets,
                            std::span<const Vertex> neighbors, int n_steps, ThreadTeam& team) {
  SUPERFACETS_ASSERT(offsets.size() == vertices.size() + 1);
  Buffer<Point> now(vertices.size());
  Buffer<Point> next(vertices.size());
  std::ranges::copy(vertices, now.begin());
  const auto move = [&](double factor) {
    team.for_each_block(std::ssize(vertices), [&](std::int64_t begin, std::int64_t end) {
      for (std::int64_t vertex = begin; vertex < end; ++vertex) {
        next[vertex] = now[vertex];
        const std::int64_t n = offsets[vertex + 1] - offsets[vertex];
        if (n == 0) continue;
        Point sum{0.0, 0.0, 0.0};
        for (const Vertex neighbor : neighbors.subspan(offsets[vertex], n)) {
          sum = sum + now[neighbor];
        }
        const Point mean = (1.0 / static_cast<double>(n)) * sum;
        next[vertex] = now[vertex] + factor * (mean - now[vertex]);
      }
    });
    std::swap(now, next);
  };
  for (int step = 0; step < n_steps; ++step) {
    move(kToward);
    move(kAway);
  }
  return now;
}

}  // namespace superfacets
