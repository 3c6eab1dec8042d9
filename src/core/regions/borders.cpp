#include "regions/borders.hpp"

#include <algorithm>
#include <mutex>
#include <tuple>

#include "base/threads.hpp"

namespace superfacets {
namespace {

struct Crossing {
  Label low;
  Label high;
  std::int64_t arc;
  double cost;
};

}  // namespace

double BorderCost::operator()(const ArcGeometry& arcs, std::span<const double> weights, Face from,
                              std::int64_t arc) const {
  const Triangle& face = arcs.faces[from];
  const int side = arcs.sides[arc];
  const Point& start = arcs.vertices[face.corners[side]];
  const Point& end = arcs.vertices[face.corners[(side + 1) % 3]];
  const Point middle = 0.5 * (start + end);
  const double geodesic = norm(arcs.centroids[from] - middle) +
                          norm(middle - arcs.centroids[arcs.neighbors[arc]]);  // eq. 1
  const double excess = std::max(0.0, weights[arc] * diagonal - geodesic);
  return norm(end - start) * std::exp(-excess / crease_scale);
}

std::vector<RegionBorder> region_borders(const ArcGeometry& arcs, std::span<const double> weights,
                                         std::span<const Label> labels, const BorderCost& cost,
                                         ThreadTeam& team) {
  std::vector<Crossing> crossings;
  std::mutex mutex;
  const auto n_faces = static_cast<std::int64_t>(labels.size());
  team.for_each_block(n_faces, [&](std::int64_t begin, std::int64_t end) {
    std::vector<Crossing> part;
    for (auto face = static_cast<Face>(begin); face < end; ++face) {
      for (std::int64_t arc = arcs.offsets[face]; arc < arcs.offsets[face + 1]; ++arc) {
        const Label other = labels[arcs.neighbors[arc]];
        if (labels[face] >= other) continue;
        part.push_back({labels[face], other, arc, cost(arcs, weights, face, arc)});
      }
    }
    const std::scoped_lock lock(mutex);
    crossings.insert(crossings.end(), part.begin(), part.end());
  });
  // By arc as well: sums are then added in the same order, however the faces were shared out.
  std::sort(crossings.begin(), crossings.end(), [](const Crossing& a, const Crossing& b) {
    return std::tie(a.low, a.high, a.arc) < std::tie(b.low, b.high, b.arc);
  });
  std::vector<RegionBorder> borders;
  for (const Crossing& crossing : crossings) {
    const bool is_new = borders.empty() || borders.back().low != crossing.low ||
                        borders.back().high != crossing.high;
    if (is_new) borders.push_back({crossing.low, crossing.high, 0.0});
    borders.back().cost += crossing.cost;
  }
  return borders;
}

std::vector<Cell> nearest_wanted(const OrderedGraph& graph, std::span<const Cell> cells,
                                 std::span<const std::uint8_t> is_wanted) {
  const auto any = std::find(is_wanted.begin(), is_wanted.end(), 1) - is_wanted.begin();
  std::vector<Place> found;
  found.reserve(cells.size());
  for (const Place place : graph.places_of(cells)) {
    found.push_back(graph.nearest(graph.positions[place], graph.place_of[any],
                                  [&](Place other) { return is_wanted[graph.cells[other]] != 0; }));
  }
  return graph.cells_at(found);
}

}  // namespace superfacets
