// Parses numbers written as text.
#pragma once

#include <string_view>

#include "base/buffer.hpp"
#include "base/threads.hpp"

namespace superfacets {

// Selected lines of a text. Line i consists of the bytes starts[i] .. ends[i]-1, and has counts[i]
// tokens.
struct LineSpans {
  std::string_view text;
  std::span<const std::int64_t> starts;
  std::span<const std::int64_t> ends;
  std::span<const std::int32_t> counts;
};

// The values of all tokens of all lines, in the order of the text.
template <typename Value>
struct ParsedLines {
  Buffer<Value> values;
  // Indices of the lines that could not be parsed, because the number of tokens is wrong or a token
  // is not a supported number. The values of these lines are 0, and must be replaced by the caller.
  std::vector<std::int64_t> left_out;
};

// Parses decimal numbers, rounded to the nearest double, like Python's float(). The tokens nan and
// inf, and numbers outside the range of a double, are not supported. In a build without from_chars,
// tokens with 64 or more bytes are not supported.
ParsedLines<double> parse_doubles(const LineSpans& lines, ThreadTeam& team);

// Parses integers. Integers outside the range of the type are not supported. In all functions of
// this file, the type `Integer` is int32 or int64.
template <typename Integer>
ParsedLines<Integer> parse_integers(const LineSpans& lines, ThreadTeam& team);

// Parses the first (kIndex = 0) or second (kIndex = 1) integer of each token. A token consists of
// one or more integers separated by slashes, as in 7, 7/2, 7//3 and 7/2/3. All integers except the
// first may be missing. A missing integer is parsed as 0.
template <int kIndex, typename Integer>
ParsedLines<Integer> parse_indices(const LineSpans& lines, ThreadTeam& team);

}  // namespace superfacets
