// The natural logarithm without the C library: the same bits everywhere.
#pragma once

#include <cmath>

#include "base/assert.hpp"

namespace superfacets {

// log(x) for finite x > 0. Error below 2 ulp; near x = 1, absolute error below 2^-52 (measured in
// tests/base).
inline double logarithm(double x) {
  SUPERFACETS_ASSERT(x > 0.0 && std::isfinite(x));
  constexpr double kLn2 = 0x1.62e42fefp-1;  // NOLINT(modernize-use-std-numbers): not all bits
  constexpr double kLn2Rest = 0x1.473de6af278edp-34;
  constexpr double kSqrtHalf = 0x1.6a09e667f3bcdp-1;
  int exponent = 0;
  double mantissa = std::frexp(x, &exponent);
  if (mantissa < kSqrtHalf) {
    mantissa += mantissa;
    --exponent;
  }
  // log m = 2 atanh(q) = 2 (q + q^3 / 3 + ...), with |q| < 0.172: the truncated terms are below
  // 2^-58.
  const double q = (mantissa - 1.0) / (mantissa + 1.0);
  const double z = q * q;
  double series = 0.0;
  for (int power = 23; power >= 3; power -= 2) series = series * z + 1.0 / power;
  const double rest = 2.0 * q * z * series + exponent * kLn2Rest;
  return exponent * kLn2 + (2.0 * q + rest);
}

}  // namespace superfacets
