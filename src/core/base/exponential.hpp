// The exponential of numbers that are not positive, without the C library: the same bits
// everywhere.
#pragma once

#include <bit>
#include <cstdint>
#include <span>

namespace superfacets {

// exp(x) for x <= 0, in [0, 1]. Error below 1 ulp (measured: tests/test_exponential.py). exp(0) =
// 1; below -708, and for what is not a number, 0, where the value would be less than 2^-1021.
inline double exponential(double x) {
  constexpr double kLowest = -708.0;
  constexpr double kPerLn2 = 1.4426950408889634;
  // ln 2 in two parts: 32 bits, so that products with whole numbers up to 2^20 are exact, and what
  // is left.
  constexpr double kLn2 = 0x1.62e42fefp-1;
  constexpr double kLn2Rest = 0x1.473de6af278edp-34;
  constexpr double kWhole = 0x1.8p52;  // what is added to it is rounded to a whole number
  constexpr int kDegree = 13;          // of the Taylor series: error 2^-57 for |r| <= ln 2 / 2
  if (!(x >= kLowest)) return 0.0;
  const double n = (x * kPerLn2 + kWhole) - kWhole;
  const double high = x - n * kLn2;  // exact
  const double low = n * kLn2Rest;
  const double r = high - low;
  const double lost = (high - r) - low;
  double factorial = 1.0;
  double inverse[kDegree + 1] = {1.0, 1.0};
  for (int i = 2; i <= kDegree; ++i) inverse[i] = 1.0 / (factorial *= i);
  double series = inverse[kDegree];
  for (int i = kDegree - 1; i >= 2; --i) series = series * r + inverse[i];
  const double power = 1.0 + (r + (r * r * series + lost));
  return power * std::bit_cast<double>((static_cast<std::int64_t>(n) + 1023) << 52);
}

// powers[i] = exponential(x[i]).
void exponentials(std::span<const double> x, std::span<double> powers);

}  // namespace superfacets
