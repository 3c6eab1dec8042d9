#include "spectral/border_rates.hpp"

namespace superfacets {
namespace {

// Lengths over which normals, the embedding and means are smoothed, and the length of arcs on which
// the rate was fitted, in units of the square root of the total area.
constexpr double kNormalLength = 0.01;
constexpr double kVectorLength = 0.02;
constexpr double kMeanLength = 0.04;
constexpr double kFittedStep = 0.007;

// Bend, per square root of the area, at which the first and the last feature are 1/2.
constexpr double kHalfBend = 4.0;

double in_unit_range(double x) {
  return x / (kHalfBend + std::abs(x));
}

double rate_of(const std::array<double, 3>& features, std::span<const double> coefficients) {
  double exponent = coefficients.back();
  std::size_t next = 3;
  for (std::size_t i = 0; i < 3; ++i) {
    exponent += coefficients[i] * features[i];
    for (std::size_t j = i; j < 3; ++j) {
      exponent += coefficients[next++] * features[i] * features[j];
    }
  }
  const double power = exponential(-std::abs(exponent));
  return (exponent > 0.0 ? 1.0 : power) / (1.0 + power);
}

// Turn of the normals along an arc, times `side` per length.
double bend_of(const Smoother& smoother, std::span<const float> normals, double side, Cell cell,
               const Step& step) {
  const auto normal = [&](Cell of) {
    const float* row = normals.data() + std::size_t{3} * of;
    return Point{row[0], row[1], row[2]};
  };
  const Point along = smoother.position(step.to) - smoother.position(cell);
  const double length = smoother.step(step.arc);
  return side * dot(normal(step.to) - normal(cell), along) / (length * length);
}

}  // namespace

Buffer<float> border_rates(const OrderedGraph& graph, const Arcs& arcs,
                           std::span<const double> widths, const CellRows& normals,
                           const CellRows& vectors, std::span<const double> coefficients,
                           ThreadTeam& team) {
  SUPERFACETS_ASSERT(normals.width == 3 && coefficients.size() == 10 && graph.total_measure > 0.0);
  const double side = std::sqrt(graph.total_measure);
  const Smoother smoother(graph, arcs, widths, team);
  const Buffer<float> smooth_normals = smoother.smoothed(normals, kNormalLength * side, team);
  const Buffer<float> smooth_vectors = smoother.smoothed(vectors, kVectorLength * side, team);
  Buffer<float> bends(arcs.n_arcs());
  Buffer<float> changes(arcs.n_arcs());
  const auto at = [](Cell cell, std::size_t column) {
    return 2 * static_cast<std::size_t>(cell) + column;
  };
  Buffer<float> means(at(arcs.n_cells(), 0));
  team.for_each_slow(arcs.n_cells(), [&](Cell cell) {
    double change = 0.0;
    double concave = 0.0;
    double total = 0.0;
    for (const Step step : arcs.steps(cell)) {
      const auto [arc, to] = step;
      bends[arc] = static_cast<float>(bend_of(smoother, smooth_normals.span(), side, cell, step));
      changes[arc] =
          static_cast<float>(side / smoother.step(arc) *
                             distance_between(smooth_vectors.span(), vectors.width, cell, to));
      const double width = smoother.width(arc);
      change += width * double{changes[arc]};
      concave += width * std::max(0.0, -double{bends[arc]});
      total += width;
    }
    means[at(cell, 0)] = static_cast<float>(total > 0.0 ? change / total : 0.0);
    means[at(cell, 1)] = static_cast<float>(total > 0.0 ? concave / total : 0.0);
  });
  means = smoother.smoothed({2, means.span()}, kMeanLength * side, team);
  Buffer<float> rates(arcs.n_arcs());
  team.for_each_slow(arcs.n_cells(), [&](Cell cell) {
    for (const auto [arc, to] : arcs.steps(cell)) {
      const auto mean = [&](std::size_t column) {
        return std::max(0.0, 0.5 * (double{means[at(cell, column)]} + means[at(to, column)]));
      };
      const double around = mean(0);
      const double change = changes[arc];
      const double sum = change + around;
      const double relative = sum > 0.0 ? (change - around) / sum : 0.0;
      const double rate =
          rate_of({in_unit_range(bends[arc]), relative, in_unit_range(mean(1))}, coefficients);
      rates[arc] = static_cast<float>(rate * (smoother.step(arc) / (kFittedStep * side)));
    }
  });
  return rates;
}

}  // namespace superfacets
