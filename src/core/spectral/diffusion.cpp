#include "spectral/diffusion.hpp"

namespace superfacets {
namespace {

// Estimated length of the border between the two cells of an arc.
double width_of(const OrderedGraph& graph, Place from, const Arc& arc) {
  return std::sqrt(graph.measures[from] + graph.measures[arc.to]);
}

// Weight of the mean of the neighbors. With a weight of 1, two cells without other neighbors would
// swap their values in each sweep.
constexpr float kDamping = 0.75F;

// Computes the new row of one cell in a sweep: the weighted sum of the rows of its neighbors and of
// its row in `own`. If kWidth > 0, it is the row width, and the loop is several times faster. If
// kWidth is 0, the width is any_width.
template <std::size_t kWidth>
void relax_row(const Arcs& arcs, const float* weights, std::size_t any_width, Cell cell,
               const float* own, const float* from, float* to) {
  const std::size_t width = kWidth > 0 ? kWidth : any_width;
  const float* here = own + width * cell;
  float* result = to + width * cell;
  float kept = 1.0F;
  std::fill(result, result + width, 0.0F);
  for (const auto [arc, neighbor] : arcs.steps(cell)) {
    const float* there = from + width * neighbor;
    for (std::size_t i = 0; i < width; ++i) result[i] += weights[arc] * there[i];
    kept -= weights[arc];
  }
  for (std::size_t i = 0; i < width; ++i) result[i] += kept * here[i];
}

// Returns the given rows after n_sweeps sweeps over all cells. `weights` has the weight of the
// neighbor's row for each arc. The rest of the weight goes to the cell's given row if
// `keeps_given`, and otherwise to its current row.
Buffer<float> swept(const Arcs& arcs, std::span<const float> weights, const CellRows& given,
                    int n_sweeps, bool keeps_given, ThreadTeam& team) {
  const std::size_t width = given.width;
  Buffer<float> rows = copy_of(given.rows);
  Buffer<float> next(rows.size());
  const auto relax_one = width == 2   ? &relax_row<2>
                         : width == 3 ? &relax_row<3>
                         : width == 8 ? &relax_row<8>
                                      : &relax_row<0>;
  for (int sweep = 0; sweep < n_sweeps; ++sweep) {
    const float* own = keeps_given ? given.rows.data() : rows.data();
    team.for_each_slow(arcs.n_cells(), [&](Cell cell) {
      relax_one(arcs, weights.data(), width, cell, own, rows.data(), next.data());
    });
    std::swap(rows, next);
  }
  return rows;
}

}  // namespace

double straight_step(const OrderedGraph& graph, Place from, const Arc& arc) {
  constexpr double kMinFraction = 0.2;
  const double straight = norm(graph.positions[arc.to] - graph.positions[from]);
  const double step = std::max(straight, kMinFraction * width_of(graph, from, arc));
  return step > 0.0 ? step : graph.straight_unit;
}

Buffer<double> straight_steps(const OrderedGraph& graph, ThreadTeam& team) {
  SUPERFACETS_ASSERT(!graph.has_rows());
  Buffer<double> steps(graph.n_arcs);
  team.for_each_index(graph.n_cells(), [&](Place place) {
    std::int64_t next = graph.offsets[place];
    for (const Arc arc : graph.arcs_of(place)) steps[next++] = straight_step(graph, place, arc);
  });
  return steps;
}

ConductingArcs conducting_arcs(const OrderedGraph& graph, double crease_unit, double steepness,
                               ThreadTeam& team) {
  SUPERFACETS_ASSERT(graph.straight_unit > 0.0);
  ConductingArcs found;
  found.offsets = Buffer<std::int64_t>(graph.n_cells() + 1);
  found.offsets[0] = 0;
  for (Cell cell = 0; cell < graph.n_cells(); ++cell) {
    const Place place = graph.place_of(cell);
    std::int64_t n = 0;  // padding arcs, which lead to the cell itself, are not counted
    for (const Arc arc : graph.arcs_of(place)) n += static_cast<std::int64_t>(arc.to != place);
    found.offsets[cell + 1] = found.offsets[cell] + n;
  }
  found.neighbors = Buffer<Cell>(found.offsets[graph.n_cells()]);
  found.steps = Buffer<double>(found.neighbors.size());
  found.conductances = Buffer<double>(found.neighbors.size());
  const double blocked = sum_over(
      graph.n_cells(),
      [&](Cell cell) {
        const Place place = graph.place_of(cell);
        std::int64_t next = found.offsets[cell];
        double sum = 0.0;
        for (const Arc arc : graph.arcs_of(place)) {
          if (arc.to == place) continue;
          const double kappa =
              crease_unit > 0.0 ? graph.crease_cost(place, arc) / crease_unit : 0.0;
          const double width = width_of(graph, place, arc);
          const double open = width * exponential(-steepness * kappa);
          found.neighbors[next] = graph.cell_at(arc.to);
          found.steps[next] = straight_step(graph, place, arc);
          found.conductances[next] = open / found.steps[next] + kMinConductance;
          sum += width - open;
          ++next;
        }
        return sum;
      },
      team);
  const double all = sum_over(
      graph.n_cells(),
      [&](Cell cell) {
        const Place place = graph.place_of(cell);
        double sum = 0.0;
        for (const Arc arc : graph.arcs_of(place)) {
          if (arc.to != place) sum += width_of(graph, place, arc);
        }
        return sum;
      },
      team);
  found.blocked_fraction = all > 0.0 ? blocked / all : 0.0;
  return found;
}

Buffer<double> sum_between(const Arcs& arcs, std::span<const double> conductances,
                           std::span<const double> steps, std::span<const Cell> coarse_of,
                           const Arcs& coarse) {
  Buffer<double> sums(coarse.n_arcs());
  std::ranges::fill(sums, 0.0);
  for (Cell cell = 0; cell < arcs.n_cells(); ++cell) {
    const Cell from = coarse_of[cell];
    const std::span<const Cell> targets = coarse.neighbors(from);
    for (const auto [arc, neighbor] : arcs.steps(cell)) {
      const Cell to = coarse_of[neighbor];
      if (to == from) continue;
      const auto at = std::ranges::lower_bound(targets, to) - targets.begin();
      SUPERFACETS_ASSERT(at < std::ssize(targets) && targets[at] == to);
      sums[coarse.offsets[from] + at] += conductances[arc] * steps[arc];
    }
  }
  return sums;
}

Buffer<float> relax(const Arcs& arcs, std::span<const double> conductances, const CellRows& given,
                    int n_sweeps, ThreadTeam& team) {
  SUPERFACETS_ASSERT(std::cmp_equal(given.rows.size(), given.width * arcs.n_cells()));
  Buffer<float> weights(arcs.n_arcs());  // weight of the neighbor's row for each arc
  team.for_each_slow(arcs.n_cells(), [&](Cell cell) {
    double total = 0.0;
    for (const auto [arc, neighbor] : arcs.steps(cell)) total += conductances[arc];
    const double factor = total > 0.0 ? kDamping / total : 0.0;
    for (const auto [arc, neighbor] : arcs.steps(cell)) {
      weights[arc] = static_cast<float>(factor * conductances[arc]);
    }
  });
  return swept(arcs, weights.span(), given, n_sweeps, false, team);
}

Smoother::Smoother(const OrderedGraph& graph, const Arcs& arcs, std::span<const double> widths,
                   ThreadTeam& team)
    : graph_(graph), arcs_(arcs), widths_(arcs.n_arcs()), steps_(arcs.n_arcs()) {
  // sum of width times step, which for estimated widths is made 4 times the area, as for any
  // Voronoi diagram
  const double total = sum_over(
      arcs.n_cells(),
      [&](Cell cell) {
        const Place place = graph.place_of(cell);
        double sum = 0.0;
        for (const auto [arc, to] : arcs.steps(cell)) {
          const Arc step{graph.place_of(to), 1.0F};
          steps_[arc] = straight_step(graph, place, step);
          widths_[arc] = widths.empty() ? width_of(graph, place, step) : widths[arc];
          sum += widths_[arc] * steps_[arc];
        }
        return sum;
      },
      team);
  const double scale = widths.empty() && total > 0.0 ? 4.0 * graph.total_measure / total : 1.0;
  total_ = sum_over(
      arcs.n_cells(),
      [&](Cell cell) {
        double sum = 0.0;
        for (const auto [arc, to] : arcs.steps(cell)) {
          widths_[arc] *= scale;
          sum += widths_[arc] / steps_[arc];
        }
        return sum;
      },
      team);
}

Buffer<float> Smoother::smoothed(const CellRows& given, double length, ThreadTeam& team) const {
  constexpr double kMaxSweeps = 20.0;
  const double squared = length * length;
  const double n_sweeps = 4.0 + 2.0 * std::ceil(squared * total_ / graph_.total_measure);
  const double least = 1e-12 * graph_.total_measure;
  Buffer<float> weights(arcs_.n_arcs());
  team.for_each_slow(arcs_.n_cells(), [&](Cell cell) {
    double sum = std::max(area(cell), least);
    for (const auto [arc, to] : arcs_.steps(cell)) sum += squared * widths_[arc] / steps_[arc];
    for (const auto [arc, to] : arcs_.steps(cell)) {
      weights[arc] = static_cast<float>(squared * widths_[arc] / steps_[arc] / sum);
    }
  });
  return swept(arcs_, weights.span(), given, static_cast<int>(std::min(kMaxSweeps, n_sweeps)), true,
               team);
}

}  // namespace superfacets
