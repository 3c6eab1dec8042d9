// Parses numbers written as text.
#pragma once

#include <string_view>

#include "base/buffer.hpp"
#include "base/threads.hpp"

namespace superfacets {

// Selected lines of a text. Line i has the bytes starts[i]..ends[i]-1, and counts[i] tokens.
struct LineSpans {
  std::string_view text;
  std::span<const std::int64_t> starts;
  std::span<const std::int64_t> ends;
  std::span<const std::int32_t> counts;
};

// The values of all tokens of the lines, one after the other.
template <typename Value>
struct ParsedLines {
  Buffer<Value> values;
  // Lines that were not parsed, because the number of tokens is wrong, or a token is not a
  // supported number. Their values are zeros, which the caller must replace.
  std::vector<std::int64_t> left_out;
};

// Parses decimals, rounded to the nearest double, like Python's float(). Not supported: nan, inf,
// and numbers outside the range of a double; in a build without from_chars, tokens of 64 bytes or
// more.
ParsedLines<double> parse_doubles(const LineSpans& lines, ThreadTeam& team);

// Parses integers. Integers out of range are not supported. Integer is int32 or int64, here and in
// the other functions.
template <typename Integer>
ParsedLines<Integer> parse_integers(const LineSpans& lines, ThreadTeam& team);

// Parses the first integer of each token. A token consists of one or more integers separated by
// slashes, as in 7, 7/2, 7//3 and 7/2/3. All except the first may be missing.
template <typename Integer>
ParsedLines<Integer> parse_corners(const LineSpans& lines, ThreadTeam& team);

// Parses the second integer of each token, in the format of parse_corners; 0 if it is missing.
template <typename Integer>
ParsedLines<Integer> parse_second_indices(const LineSpans& lines, ThreadTeam& team);

}  // namespace superfacets
