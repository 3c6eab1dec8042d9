// Finds the lines of a text, and the keyword that each line begins with.
#pragma once

#include <string>
#include <string_view>

#include "base/buffer.hpp"
#include "base/threads.hpp"

namespace superfacets {

// Whether a byte separates tokens. Separators are the bytes that Python's bytes.split() treats as
// whitespace.
inline bool is_blank(char c) {
  return c == ' ' || (c >= '\t' && c <= '\r');
}

// Lines of a text that have at least one token, in their order.
struct TextLines {
  Buffer<std::int64_t> starts;  // first byte of the first token
  Buffer<std::int64_t> ends;    // one past the last byte: at a newline, a comment or the end
  Buffer<std::int32_t> counts;  // number of tokens
};

// Finds the lines that begin in bytes begin..end-1 of the text. A line must begin at `begin`. Lines
// end at newlines and at the end of the text. The character `comment` starts a comment up to the
// end of the line; if it is 0, there are no comments.
TextLines scan_lines(std::string_view text, std::int64_t begin, std::int64_t end, char comment,
                     ThreadTeam& team);

// Writes for each line the index of the keyword that equals the first token of the line, or the
// number of keywords if no keyword does. A keyword ends at the end of the line, a blank or a
// control character. With `any_case`, the case of the line is ignored, and keywords must be in
// lower case.
void match_keywords(std::string_view text, std::span<const std::int64_t> starts,
                    std::span<const std::int64_t> ends, const std::vector<std::string>& keywords,
                    bool any_case, ThreadTeam& team, std::span<std::int8_t> found);

}  // namespace superfacets
