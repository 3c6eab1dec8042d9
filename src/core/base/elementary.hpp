// Elementary functions that do not use the C library, so that results have the same bits on every
// platform.
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>

#include "base/assert.hpp"
#include "base/versions.hpp"

namespace superfacets {

namespace elementary_parts {

// Coefficients of P in ascending order, for atan(q) = q + q z P(z) with z = q^2. P is computed with
// the Remez algorithm, which minimizes the maximum error of z P(z) on 0 <= z <= 1/4. This maximum
// error is 2^-62.
inline constexpr std::array<double, 13> kSeries{
    -0.33333333333333315,  0.19999999999993445, -0.14285714284977744,  0.11111111069363067,
    -0.09090907692059402,  0.07692277476441967, -0.06666223702917291,  0.05877809365040213,
    -0.052300303597027926, 0.04589534242481706, -0.037121323435362535, 0.023659351268061797,
    -0.008368794178450841,
};

// pi / 4 as a sum of two doubles. The first one is the double nearest to pi / 4. The first double
// ends in three zero bits, so its products with the integers 0 to 4 are exact. The second double is
// the remainder.
inline constexpr double kEighthTurn = 0x1.921fb54442d18p-1;
inline constexpr double kEighthTurnRest = 0x1.1a62633145c07p-55;

// ln 2 as a sum of two doubles. The first has the first 33 bits of ln 2, so its products with whole
// numbers up to 2^20 are exact. The second is the remainder.
inline constexpr double kLn2 = 0x1.62e42fefp-1;  // NOLINT(modernize-use-std-numbers): not all bits
inline constexpr double kLn2Rest = 0x1.473de6af278edp-34;

}  // namespace elementary_parts

// Rounds 0 <= x < 2^52 to an integer, ties to even, like std::nearbyint. With the baseline
// instruction set, std::nearbyint is a function call per number.
SUPERFACETS_ALWAYS_INLINE double round_to_whole(double x) {
  constexpr double kNoFraction = 0x1p52;  // doubles of this size or larger have no fraction bits
  return (x + kNoFraction) - kNoFraction;
}

// The angle from the positive x axis to (x, y), for y >= 0: atan2(y, x), in [0, pi]. The error is
// below 1.6 ulp (1.5 is measured in tests/base). The result is exact or correctly rounded at the
// ends: 0 for y = 0 and x > 0, pi / 2 for x = 0 and y > 0, pi for y = 0 and x < 0. If both
// arguments are 0 (with either sign), the result is 0. Arguments are at most 2^1022 in magnitude.
// The function only adds, multiplies, divides and selects, so the result has the same bits on all
// platforms where these operations follow IEEE 754 and are not fused.
SUPERFACETS_ALWAYS_INLINE double arctangent(double y, double x) {
  using namespace elementary_parts;
  const bool is_left = x < 0.0;
  const double width = std::abs(x);
  // The angle of (width, y) is computed as 0, pi / 4 or pi / 2 plus atan(q), where |q| <= 1/2. If
  // pi / 4 is added, the subtraction below is exact (Sterbenz lemma). Selecting between a number
  // and 0 takes a single instruction, and adding 0 is exact.
  const bool is_flat = y + y <= width;
  const bool is_steep = y > width + width;
  const double top = (is_steep ? 0.0 : y) - (is_flat ? 0.0 : width);
  const double bottom = (is_steep ? 0.0 : width) + (is_flat ? 0.0 : y);
  const double eighths = (is_flat ? 0.0 : 1.0) + (is_steep ? 1.0 : 0.0);
  const double ratio = top / (bottom + (bottom == 0.0 ? 1.0 : 0.0));
  const double q = is_left ? -ratio : ratio;
  const double n = is_left ? 4.0 - eighths : eighths;
  const double z = q * q;
  // Even and odd powers are summed separately, to halve the chain of dependent operations.
  const double zz = z * z;
  double even = kSeries[12];
  double odd = kSeries[11];
  for (int i = 10; i >= 0; i -= 2) even = even * zz + kSeries[i];
  for (int i = 9; i >= 1; i -= 2) odd = odd * zz + kSeries[i];
  const double series = even + z * odd;
  // `sum` is the rounded value of turn + q, and `lost` is its rounding error.
  const double turn = n * kEighthTurn;
  const double sum = turn + q;
  const double lost = (turn - sum) + q;
  return sum + (q * (z * series) + (lost + n * kEighthTurnRest));
}

// Sets angles[i] = arctangent(y[i], x[i]). All instruction sets give bit-identical results. The
// processor must support `with`. Takes about 2 ns per element with AVX2, and 6 ns with SSE2.
void arctangents(std::span<const double> y, std::span<const double> x, std::span<double> angles,
                 InstructionSet with = best_instruction_set());

// 1 / i!, the coefficients of the Taylor series of exp(r) up to degree 13. The error of the series
// is 2^-57 for |r| <= ln 2 / 2.
constexpr std::array<double, 14> inverse_factorials() {
  std::array<double, 14> inverse{1.0};
  double factorial = 1.0;
  for (std::size_t i = 1; i < inverse.size(); ++i) {
    factorial *= static_cast<double>(i);
    inverse[i] = 1.0 / factorial;
  }
  return inverse;
}

// exp(x) for x <= 0, in [0, 1]. The error is below 1 ulp (0.87 is measured in tests/base). The
// result is exactly 1 for x = 0. The result is 0 for NaN and for x < -708, where exp(x) is less
// than 2^-1021.
inline double exponential(double x) {
  using namespace elementary_parts;
  constexpr double kLowest = -708.0;
  // Adding and then subtracting this number rounds to an integer.
  constexpr double kWhole = 0x1.8p52;
  if (!(x >= kLowest)) return 0.0;
  const double n = (x * std::numbers::log2e + kWhole) - kWhole;
  const double high = x - n * kLn2;  // exact
  const double low = n * kLn2Rest;
  const double r = high - low;
  const double lost = (high - r) - low;
  constexpr auto kFactors = inverse_factorials();
  double series = kFactors.back();
  for (std::size_t i = kFactors.size() - 1; i-- > 2;) series = series * r + kFactors[i];
  const double power = 1.0 + (r + (r * r * series + lost));
  return power * std::bit_cast<double>(static_cast<std::uint64_t>(n + 1023.0) << 52U);
}

// Sets powers[i] = exponential(x[i]).
void exponentials(std::span<const double> x, std::span<double> powers);

}  // namespace superfacets
