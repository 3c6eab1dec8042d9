#include "spatial/normals.hpp"

#include <algorithm>

namespace superfacets {
namespace {

// Points with variances a <= b <= c along their principal axes have a normal if (b - a) (c - a) is
// larger than about this fraction of (a + b + c)^2. So points in a strip that is a thousand times
// as long as wide have a normal.
constexpr double kMinDifference = 1e-7;

// Maximum number of Newton steps. The method converges to the smallest root from below, and its
// last steps double the number of correct digits.
constexpr int kMaxSteps = 60;

// The covariance matrix, scaled so that its trace (sum of the variances) is 1. Zero if all points
// have the same position.
Symmetric covariance_of(const Spread& spread) {
  const Point mean = (1.0 / spread.n) * spread.sum;
  const auto& [x, y, z] = spread.sum;
  const auto& [xx, xy, xz, yy, yz, zz] = spread.products;
  const Symmetric c{xx - x * mean.x, xy - x * mean.y, xz - x * mean.z,
                    yy - y * mean.y, yz - y * mean.z, zz - z * mean.z};
  const double trace = c.xx + c.yy + c.zz;
  if (!(trace > 0.0)) return {};
  const double scale = 1.0 / trace;
  return {scale * c.xx, scale * c.xy, scale * c.xz, scale * c.yy, scale * c.yz, scale * c.zz};
}

// The smallest eigenvalue of a covariance matrix with trace 1. The characteristic polynomial x^3 -
// x^2 + q x - det is concave and increasing up to its smallest root, so Newton's method from 0
// never overshoots.
double smallest_eigenvalue(const Symmetric& c) {
  const double q =
      (c.xx * c.yy - c.xy * c.xy) + (c.xx * c.zz - c.xz * c.xz) + (c.yy * c.zz - c.yz * c.yz);
  const double determinant = c.xx * (c.yy * c.zz - c.yz * c.yz) -
                             c.xy * (c.xy * c.zz - c.yz * c.xz) +
                             c.xz * (c.xy * c.yz - c.yy * c.xz);
  double x = 0.0;
  for (int step = 0; step < kMaxSteps; ++step) {
    const double value = ((x - 1.0) * x + q) * x - determinant;
    const double slope = (3.0 * x - 2.0) * x + q;
    if (!(value < 0.0) || !(slope > 0.0)) break;
    const double next = x - value / slope;
    if (!(next > x)) break;
    x = next;
  }
  return x;
}

// The unit eigenvector of the smallest eigenvalue of a matrix with trace 1. Zero if this eigenvalue
// is not unique.
Point least_direction(const Symmetric& c) {
  const double least = smallest_eigenvalue(c);
  // The eigenvector is orthogonal to the rows of (matrix - eigenvalue * identity), so it is
  // parallel to their cross products.
  const Point rows[] = {
      {c.xx - least, c.xy, c.xz}, {c.xy, c.yy - least, c.yz}, {c.xz, c.yz, c.zz - least}};
  const Point crossed[] = {cross(rows[0], rows[1]), cross(rows[1], rows[2]),
                           cross(rows[2], rows[0])};
  const Point* longest = &crossed[0];
  for (const Point& vector : crossed) {
    if (squared_norm(vector) > squared_norm(*longest)) longest = &vector;
  }
  const double length = norm(*longest);
  if (!(length > kMinDifference)) return {0.0, 0.0, 0.0};
  return (1.0 / length) * *longest;
}

}  // namespace

Point direction_of_least_spread(const Spread& spread) {
  return least_direction(covariance_of(spread));
}

Point common_axis(const AxisSpread& spread) {
  if (!(spread.n > 0.0)) return {0.0, 0.0, 0.0};
  // Let S be the sum of products, with trace n. The matrix (1 - S / n) / 2 has trace 1, and the
  // eigenvector of its smallest eigenvalue is the eigenvector of the largest eigenvalue of S.
  const double scale = 0.5 / spread.n;
  return least_direction({0.5 - scale * spread.products.xx, -scale * spread.products.xy,
                          -scale * spread.products.xz, 0.5 - scale * spread.products.yy,
                          -scale * spread.products.yz, 0.5 - scale * spread.products.zz});
}

}  // namespace superfacets
