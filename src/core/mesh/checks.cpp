#include "mesh/checks.hpp"

#include "base/box.hpp"

namespace superfacets {
namespace {

bool is_finite(const Point& p) {
  return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}

// Sets is_used[vertex] = 1 for each corner. Returns false if a corner is not the index of a vertex.
bool mark_used(std::span<const Vertex> corners, std::span<std::uint8_t> is_used, ThreadTeam& team) {
  std::atomic<bool> is_in_range = true;
  const auto n_corners = static_cast<std::int64_t>(corners.size());
  team.for_each_block(n_corners, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t i = begin; i < end; ++i) {
      // Negative indices become large numbers, so one comparison suffices.
      const auto index = static_cast<std::uint32_t>(corners[i]);
      if (index >= is_used.size()) {
        is_in_range.store(false, std::memory_order_relaxed);
        return;
      }
      std::atomic_ref(is_used[index]).store(1, std::memory_order_relaxed);
    }
  });
  return is_in_range;
}

}  // namespace

MeshFindings check_mesh(std::span<const Point> vertices, std::span<const Vertex> corners,
                        ThreadTeam& team) {
  MeshFindings findings;
  Buffer<std::uint8_t> is_used(vertices.size());
  team.fill(is_used.span(), std::uint8_t{0});
  findings.is_in_range = mark_used(corners, is_used.span(), team);

  Box bounds;
  std::mutex mutex;  // protects `bounds` and `findings`
  const auto n_vertices = static_cast<std::int64_t>(vertices.size());
  team.for_each_block(n_vertices, [&](std::int64_t begin, std::int64_t end) {
    Box box;
    bool all_finite = true;
    for (std::int64_t v = begin; v < end; ++v) {
      all_finite &= is_finite(vertices[v]);
      if (is_used[v]) box.include(vertices[v]);
    }
    const std::scoped_lock lock(mutex);
    bounds.include(box);
    findings.is_finite &= all_finite;
  });
  findings.low = bounds.low;
  findings.high = bounds.high;
  return findings;
}

NumberFindings check_numbers(std::span<const double> numbers, ThreadTeam& team) {
  NumberFindings findings;
  std::mutex mutex;  // protects `findings`
  const auto n = static_cast<std::int64_t>(numbers.size());
  team.for_each_block(n, [&](std::int64_t begin, std::int64_t end) {
    bool all_valid = true;
    double largest = 0.0;
    for (std::int64_t i = begin; i < end; ++i) {
      all_valid &= numbers[i] >= 0.0;  // the comparison is false for NaN
      largest = std::max(largest, numbers[i]);
    }
    const std::scoped_lock lock(mutex);
    findings.is_valid &= all_valid && largest < kInfinity;
    findings.largest = std::max(findings.largest, largest);
  });
  return findings;
}

}  // namespace superfacets
