#include "text/scan_lines.hpp"

#include <cstring>
#include <limits>

namespace superfacets {
namespace {

constexpr std::int64_t kChunk = 1 << 16;  // number of bytes per task, small enough for the cache

// Returns the index of the first byte equal to `wanted` in begin..end-1, or `end`.
std::int64_t find(std::string_view text, std::int64_t begin, std::int64_t end, char wanted) {
  const void* place = std::memchr(text.data() + begin, wanted, end - begin);
  return place == nullptr ? end : static_cast<const char*>(place) - text.data();
}

// Returns the start of the first line that starts at or after byte `place`. A line must start at
// `begin`. If no line starts between `place` and `end`, the result is at least `end`.
std::int64_t next_line(std::string_view text, std::int64_t begin, std::int64_t place,
                       std::int64_t end) {
  return place <= begin ? begin : find(text, place - 1, end, '\n') + 1;
}

// Calls visit(start, end) for each line that begins in bytes begin .. end-1 and has at least one
// token.
template <typename Visit>
void for_each_line(std::string_view text, std::int64_t begin, std::int64_t end, char comment,
                   const Visit& visit) {
  const auto size = static_cast<std::int64_t>(text.size());
  while (begin < end) {
    const std::int64_t newline = find(text, begin, size, '\n');
    const std::int64_t line_end = comment == 0 ? newline : find(text, begin, newline, comment);
    while (begin < line_end && is_blank(text[begin])) ++begin;
    if (begin < line_end) visit(begin, line_end);
    begin = newline + 1;
  }
}

std::int32_t count_tokens(std::string_view line) {
  bool was_blank = true;
  std::int64_t n_tokens = 0;
  for (const char c : line) {
    const bool blank = is_blank(c);
    n_tokens += static_cast<std::int64_t>(was_blank && !blank);
    was_blank = blank;
  }
  constexpr std::int64_t kMost = std::numeric_limits<std::int32_t>::max();
  return static_cast<std::int32_t>(std::min(n_tokens, kMost));
}

char lower(char c) {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

bool begins_with(std::string_view line, std::string_view keyword, bool any_case) {
  if (line.size() < keyword.size()) return false;
  for (std::size_t i = 0; i < keyword.size(); ++i) {
    if ((any_case ? lower(line[i]) : line[i]) != keyword[i]) return false;
  }
  return line.size() == keyword.size() || static_cast<unsigned char>(line[keyword.size()]) <= ' ';
}

}  // namespace

TextLines scan_lines(std::string_view text, std::int64_t begin, std::int64_t end, char comment,
                     ThreadTeam& team) {
  SUPERFACETS_ASSERT(begin >= 0 && begin <= end && std::cmp_less_equal(end, text.size()));
  const std::int64_t n_chunks = (end - begin + kChunk - 1) / kChunk;
  auto lines_of_chunk = [&](std::int64_t chunk, const auto& visit) {
    const std::int64_t to = std::min(end, begin + (chunk + 1) * kChunk);
    const std::int64_t from = next_line(text, begin, begin + chunk * kChunk, to);
    for_each_line(text, from, to, comment, visit);
  };
  // Before the prefix sum, firsts[i + 1] is the number of lines in chunk i. After it, firsts[i] is
  // the number of lines before chunk i.
  std::vector<std::int64_t> firsts(n_chunks + 1, 0);
  team.for_each(n_chunks, [&](std::int64_t chunk, int) {
    lines_of_chunk(chunk, [&](std::int64_t, std::int64_t) { ++firsts[chunk + 1]; });
  });
  for (std::int64_t chunk = 0; chunk < n_chunks; ++chunk) firsts[chunk + 1] += firsts[chunk];

  const auto n_lines = static_cast<std::size_t>(firsts[n_chunks]);
  TextLines lines{Buffer<std::int64_t>(n_lines), Buffer<std::int64_t>(n_lines),
                  Buffer<std::int32_t>(n_lines)};
  team.for_each(n_chunks, [&](std::int64_t chunk, int) {
    std::int64_t line = firsts[chunk];
    lines_of_chunk(chunk, [&](std::int64_t start, std::int64_t line_end) {
      lines.starts[line] = start;
      lines.ends[line] = line_end;
      lines.counts[line] = count_tokens(text.substr(start, line_end - start));
      ++line;
    });
  });
  return lines;
}

Buffer<std::int8_t> match_keywords(std::string_view text, std::span<const std::int64_t> starts,
                                   std::span<const std::int64_t> ends,
                                   const std::vector<std::string>& keywords, bool any_case,
                                   ThreadTeam& team) {
  SUPERFACETS_ASSERT(starts.size() == ends.size());
  SUPERFACETS_ASSERT(keywords.size() <= std::numeric_limits<std::int8_t>::max());
  Buffer<std::int8_t> found(starts.size());
  team.for_each_index(std::ssize(starts), [&](std::int64_t i) {
    const std::string_view line = text.substr(starts[i], ends[i] - starts[i]);
    std::size_t keyword = 0;
    while (keyword < keywords.size() && !begins_with(line, keywords[keyword], any_case)) ++keyword;
    found[i] = static_cast<std::int8_t>(keyword);
  });
  return found;
}

}  // namespace superfacets
