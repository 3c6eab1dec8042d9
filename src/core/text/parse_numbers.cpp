#include "text/parse_numbers.hpp"

#include <charconv>
#include <numeric>
#include <system_error>

#include "text/scan_lines.hpp"

// Some standard libraries have no from_chars for floating point: libc++ before version 20, and
// libstdc++ before GCC 11.
#if defined(__cpp_lib_to_chars) && !defined(SUPERFACETS_WITHOUT_FROM_CHARS)
#define SUPERFACETS_HAS_FROM_CHARS
#else
#include <cerrno>
#include <clocale>
#include <cstdlib>
#include <cstring>
#if defined(__APPLE__)
#include <xlocale.h>
#endif
#endif

namespace superfacets {
namespace {

constexpr std::int64_t kLinesAtOnce = 4096;  // number of lines per task

bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

// Skips a plus sign before a digit or a decimal point, because from_chars rejects the sign.
const char* skip_plus(const char* begin, const char* end) {
  const bool is_plus = end - begin >= 2 && *begin == '+' && (is_digit(begin[1]) || begin[1] == '.');
  return is_plus ? begin + 1 : begin;
}

#if defined(SUPERFACETS_HAS_FROM_CHARS)

const char* parse_plain_double(const char* begin, const char* end, double& value) {
  const auto [stop, error] = std::from_chars(begin, end, value);
  return error == std::errc() ? stop : nullptr;
}

#else

// Calls strtod in the "C" locale, independent of the locale of the process.
double to_double(const char* token, char** stop) {
#if defined(_MSC_VER)
  static const _locale_t plain = _create_locale(LC_ALL, "C");
  return _strtod_l(token, stop, plain);
#else
  static const locale_t plain = newlocale(LC_ALL_MASK, "C", nullptr);
  return strtod_l(token, stop, plain);
#endif
}

const char* parse_plain_double(const char* begin, const char* end, double& value) {
  char token[64];  // strtod needs a terminating zero; longer tokens are rare and not supported
  const auto* stop =
      std::find_if(begin, end, [](char c) { return !is_digit(c) && !std::strchr("+-.eE", c); });
  const std::size_t size = stop - begin;
  if (size >= sizeof(token)) return nullptr;
  std::memcpy(token, begin, size);
  token[size] = '\0';
  char* token_end = nullptr;
  errno = 0;
  value = to_double(token, &token_end);
  return errno == 0 ? begin + (token_end - token) : nullptr;
}

#endif

// The functions from here to parse_index parse the token at `begin`, which has at least one byte.
// These functions return the end of the parsed part, or null if the token cannot be parsed.

const char* parse_double(const char* begin, const char* end, double& value) {
  begin = skip_plus(begin, end);
  const char* first = begin + (*begin == '-' ? 1 : 0);
  const bool is_plain = first < end && (is_digit(*first) || *first == '.');  // excludes nan and inf
  return is_plain ? parse_plain_double(begin, end, value) : nullptr;
}

template <typename Integer>
const char* parse_integer(const char* begin, const char* end, Integer& value) {
  const auto [stop, error] = std::from_chars(skip_plus(begin, end), end, value);
  return error == std::errc() ? stop : nullptr;
}

// Sets `value` to the integer with the index kIndex of the token, or to 0 if this integer is
// missing.
template <int kIndex, typename Integer>
const char* parse_index(const char* begin, const char* end, Integer& value) {
  value = 0;
  const char* place = begin;
  for (int i = 0;; ++i, ++place) {
    Integer index = 0;
    const bool is_absent = i > 0 && (place == end || *place == '/' || is_blank(*place));
    if (!is_absent) place = parse_integer(place, end, index);
    if (i == kIndex) value = index;
    if (place == nullptr || place == end || *place != '/') return place;
  }
}

// Parses one token per value. Returns false if the number of tokens differs from the number of
// values, or if a token is not a number.
template <typename Value, typename ParseToken>
bool parse_line(const char* place, const char* end, std::span<Value> values,
                const ParseToken& parse_token) {
  for (Value& value : values) {
    while (place < end && is_blank(*place)) ++place;
    if (place == end) return false;
    place = parse_token(place, end, value);
    if (place == nullptr || (place < end && !is_blank(*place))) return false;
  }
  return std::all_of(place, end, is_blank);
}

template <typename Value, typename ParseToken>
ParsedLines<Value> parse_lines(const LineSpans& lines, ThreadTeam& team,
                               const ParseToken& parse_token) {
  SUPERFACETS_ASSERT(lines.starts.size() == lines.counts.size());
  SUPERFACETS_ASSERT(lines.ends.size() == lines.counts.size());
  const auto n_lines = static_cast<std::int64_t>(lines.counts.size());
  const std::int64_t n_chunks = (n_lines + kLinesAtOnce - 1) / kLinesAtOnce;
  std::vector<std::int64_t> firsts(n_chunks + 1, 0);  // number of values before each chunk
  for (std::int64_t chunk = 0; chunk < n_chunks; ++chunk) {
    const std::int64_t begin = chunk * kLinesAtOnce;
    const auto counts = lines.counts.subspan(begin, std::min(kLinesAtOnce, n_lines - begin));
    firsts[chunk + 1] = std::accumulate(counts.begin(), counts.end(), firsts[chunk]);
  }
  ParsedLines<Value> parsed{Buffer<Value>(firsts[n_chunks]), {}};
  std::vector<std::vector<std::int64_t>> left_out(n_chunks);

  team.for_each(n_chunks, [&](std::int64_t chunk, int) {
    Value* first = parsed.values.data() + firsts[chunk];
    const std::int64_t end = std::min(n_lines, (chunk + 1) * kLinesAtOnce);
    for (std::int64_t line = chunk * kLinesAtOnce; line < end; ++line) {
      const auto values = std::span(first, lines.counts[line]);
      const char* text = lines.text.data();
      if (!parse_line(text + lines.starts[line], text + lines.ends[line], values, parse_token)) {
        std::ranges::fill(values, Value{0});
        left_out[chunk].push_back(line);
      }
      first += values.size();
    }
  });
  for (const auto& some : left_out) {
    parsed.left_out.insert(parsed.left_out.end(), some.begin(), some.end());
  }
  return parsed;
}

}  // namespace

ParsedLines<double> parse_doubles(const LineSpans& lines, ThreadTeam& team) {
  return parse_lines<double>(lines, team, parse_double);
}

template <typename Integer>
ParsedLines<Integer> parse_integers(const LineSpans& lines, ThreadTeam& team) {
  return parse_lines<Integer>(lines, team, parse_integer<Integer>);
}

template <int kIndex, typename Integer>
ParsedLines<Integer> parse_indices(const LineSpans& lines, ThreadTeam& team) {
  return parse_lines<Integer>(lines, team, parse_index<kIndex, Integer>);
}

template ParsedLines<std::int32_t> parse_integers(const LineSpans& lines, ThreadTeam& team);
template ParsedLines<std::int64_t> parse_integers(const LineSpans& lines, ThreadTeam& team);
template ParsedLines<std::int32_t> parse_indices<0>(const LineSpans& lines, ThreadTeam& team);
template ParsedLines<std::int64_t> parse_indices<0>(const LineSpans& lines, ThreadTeam& team);
template ParsedLines<std::int32_t> parse_indices<1>(const LineSpans& lines, ThreadTeam& team);
template ParsedLines<std::int64_t> parse_indices<1>(const LineSpans& lines, ThreadTeam& team);

}  // namespace superfacets
