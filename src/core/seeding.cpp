#include "seeding.hpp"

#include <algorithm>
#include <bit>
#include <limits>
#include <numeric>
#include <tuple>
#include <unordered_map>
#include <utility>

#include "classify.hpp"
#include "farthest.hpp"

namespace superfacets {
namespace {

// Which cells some region has reached, and the expansion of one more region.
class Flood {
 public:
  Flood(const CellGraph& graph, double reach)
      : graph_(graph),
        squared_reach_(reach * reach),
        is_reached_(graph.n_cells(), false),
        visited_by_(graph.n_cells(), kNoLabel) {}

  bool is_reached(Cell cell) const { return is_reached_[cell]; }

  // Which cells are reached does not depend on the order in which they are, so a stack does where
  // the classification needs Dijkstra's algorithm.
  void expand(Cell seed, Label label) {
    reach_cell(seed, label);
    while (!stack_.empty()) {
      const Cell cell = stack_.back();
      stack_.pop_back();
      const double squared = squared_norm(graph_.positions[cell] - graph_.positions[seed]);
      if (squared <= squared_reach_) reach_neighbors(cell, label);
    }
  }

 private:
  void reach_neighbors(Cell cell, Label label) {
    for (std::int64_t arc = graph_.offsets[cell]; arc < graph_.offsets[cell + 1]; ++arc) {
      if (visited_by_[graph_.neighbors[arc]] != label) reach_cell(graph_.neighbors[arc], label);
    }
  }

  void reach_cell(Cell cell, Label label) {
    visited_by_[cell] = label;
    is_reached_[cell] = true;
    stack_.push_back(cell);
  }

  const CellGraph& graph_;
  const double squared_reach_;
  std::vector<bool> is_reached_;   // (N,) by any region
  std::vector<Label> visited_by_;  // (N,) the last region that came by
  std::vector<Cell> stack_;        // cells of the present region still to be expanded
};

// Cells by component (that of `first`, then by lowest cell), then by path length, then by index.
std::vector<Cell> visiting_order(const CellGraph& graph, Cell first) {
  const Classification from_first = classify_exact(graph, std::span(&first, 1));
  std::vector<Cell> order(graph.n_cells());
  std::iota(order.begin(), order.end(), 0);
  // With one center a component, the label is the component.
  auto key = [&](Cell cell) {
    return std::tuple(from_first.labels[cell], from_first.lengths[cell], cell);
  };
  std::sort(order.begin(), order.end(), [&](Cell a, Cell b) { return key(a) < key(b); });
  return order;
}

// A cube of the grid by its numbers along the axes: whole, and as doubles free of overflow.
struct Cube {
  double x, y, z;
  bool operator==(const Cube&) const = default;
};

struct CubeHash {
  std::size_t operator()(const Cube& cube) const {
    // Odd multipliers near 2^64 / golden ratio; neighbors in space land far apart.
    std::uint64_t h = std::bit_cast<std::uint64_t>(cube.x) * 0x9e3779b97f4a7c15ULL;
    h = (h ^ h >> 32 ^ std::bit_cast<std::uint64_t>(cube.y)) * 0xbf58476d1ce4e5b9ULL;
    h = (h ^ h >> 32 ^ std::bit_cast<std::uint64_t>(cube.z)) * 0x94d049bb133111ebULL;
    return static_cast<std::size_t>(h ^ h >> 32);
  }
};

}  // namespace

Cell nearest_cell(std::span<const Point> positions, Point target) {
  Cell nearest = 0;
  double nearest_squared = std::numeric_limits<double>::infinity();
  for (std::size_t cell = 0; cell < positions.size(); ++cell) {
    const double squared = squared_norm(positions[cell] - target);
    if (squared >= nearest_squared) continue;
    nearest_squared = squared;
    nearest = static_cast<Cell>(cell);
  }
  return nearest;
}

std::vector<Cell> farthest_seeds(std::span<const Point> positions, Cell first, Cell n_seeds) {
  FarthestPoints points(positions);
  std::vector<Cell> seeds{first};
  points.place(first);
  while (std::cmp_less(seeds.size(), n_seeds)) {
    seeds.push_back(points.farthest());
    points.place(seeds.back());
  }
  return seeds;
}

std::vector<Cell> flood_seeds(const CellGraph& graph, Cell first, double reach) {
  Flood flood(graph, reach);
  std::vector<Cell> seeds;
  for (const Cell cell : visiting_order(graph, first)) {
    if (flood.is_reached(cell)) continue;
    flood.expand(cell, static_cast<Label>(seeds.size()));
    seeds.push_back(cell);
  }
  return seeds;
}

std::vector<Label> grid_labels(std::span<const Point> positions, Point corner, double side) {
  std::unordered_map<Cube, Label, CubeHash> label_of;
  std::vector<Label> labels;
  labels.reserve(positions.size());
  for (const Point& p : positions) {
    const Point offset = p - corner;
    // Adding 0.0 turns a -0.0 that floor keeps into 0.0, which must hash alike.
    const Cube cube{std::floor(offset.x / side) + 0.0, std::floor(offset.y / side) + 0.0,
                    std::floor(offset.z / side) + 0.0};
    labels.push_back(label_of.try_emplace(cube, static_cast<Label>(label_of.size())).first->second);
  }
  return labels;
}

}  // namespace superfacets
