// Finds the lines of a text, and the keyword at the start of each line.
#pragma once

#include <string>
#include <string_view>

#include "base/buffer.hpp"
#include "base/threads.hpp"

namespace superfacets {

// Whether a byte is whitespace between tokens. This is the whitespace of Python's bytes.split().
inline bool is_blank(char c) {
  return c == ' ' || (c >= '\t' && c <= '\r');
}

// The lines that have at least one token, in the order of the text.
struct TextLines {
  Buffer<std::int64_t> starts;  // index of the first byte of the first token of each line
  Buffer<std::int64_t> ends;    // one past the last byte: index of the newline, comment or text end
  Buffer<std::int32_t> counts;  // number of tokens of each line
};

// Finds the lines that begin in bytes begin..end-1 of the text. A line must begin at `begin`. Lines
// end at newlines and at the end of the text. The character `comment` starts a comment up to the
// end of the line; if it is 0, there are no comments.
TextLines scan_lines(std::string_view text, std::int64_t begin, std::int64_t end, char comment,
                     ThreadTeam& team);

// Returns for each line the index of the keyword that equals its first token, or the number of
// keywords if there is no such keyword. The first token ends at whitespace, at a control
// character or at the end of the line. If any_case is true, the comparison ignores the case of the
// line, and keywords must be lower case.
Buffer<std::int8_t> match_keywords(std::string_view text, std::span<const std::int64_t> starts,
                                   std::span<const std::int64_t> ends,
                                   const std::vector<std::string>& keywords, bool any_case,
                                   ThreadTeam& team);

}  // namespace superfacets
