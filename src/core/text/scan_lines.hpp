// Where the lines of a text are, and which word each begins with.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/buffer.hpp"
#include "base/threads.hpp"

namespace superfacets {

// What separates tokens, within lines: the blanks of Python's bytes.split().
inline bool is_blank(char c) {
  return c == ' ' || (c >= '\t' && c <= '\r');
}

// Lines of a text with at least one token each, in their order.
struct TextLines {
  Buffer<std::int64_t> starts;  // first byte of the first token
  Buffer<std::int64_t> ends;    // byte behind the last of the line: a newline, a comment, the end
  Buffer<std::int32_t> counts;  // tokens
};

// Finds the lines that begin in bytes begin..end-1 of the text; a line begins at `begin`. Newlines
// end lines, and so does the end of the text. What follows the character `comment` on a line is no
// part of it; 0 where there are no comments.
TextLines scan_lines(std::string_view text, std::int64_t begin, std::int64_t end, char comment,
                     ThreadTeam& team);

// Writes for each line which of the keywords is its first token; the number of keywords where none
// is. A keyword ends at the end of the line, at a blank or at a control character. With `any_case`
// letters count as their lower case; keywords are in lower case.
void match_keywords(std::string_view text, std::span<const std::int64_t> starts,
                    std::span<const std::int64_t> ends, const std::vector<std::string>& keywords,
                    bool any_case, ThreadTeam& team, std::span<std::int8_t> found);

}  // namespace superfacets
