// Bindings of the kernels that read files. The functions are documented in the headers of text/.
// Their preconditions are checked by superfacets/files/guards.py and superfacets/files/readers.
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "bindings/bindings.hpp"
#include "text/binary_rows.hpp"
#include "text/parse_numbers.hpp"
#include "text/scan_lines.hpp"

namespace superfacets {
namespace {

// Minimum number of bytes to scan, and of lines to parse, per thread.
constexpr std::int64_t kBytesPerThread = 1 << 16;
constexpr std::int64_t kLinesPerThread = 1 << 12;

using ByteRows = nb::ndarray<const std::uint8_t, nb::ndim<2>, nb::device::cpu>;

std::string_view as_text(Bytes bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

auto lines_of(Bytes text, std::int64_t begin, std::int64_t end, int comment, int n_threads) {
  const auto scan = [&](ThreadTeam& team) {
    return scan_lines(as_text(text), begin, end, static_cast<char>(comment), team);
  };
  return on_team(end - begin, n_threads, scan, kBytesPerThread);
}

Buffer<std::int8_t> matched(Bytes text, Offsets starts, Offsets ends,
                            const std::vector<std::string>& keywords, bool any_case,
                            ThreadTeam& team) {
  return match_keywords(as_text(text), starts, ends, keywords, any_case, team);
}

template <auto kParse>
void define_parse(nb::module_& module, const char* name) {
  const auto parse = [](Bytes text, Offsets starts, Offsets ends, Integers counts, int n_threads) {
    const LineSpans lines{as_text(text), starts, ends, counts};
    const auto work = [&](ThreadTeam& team) { return kParse(lines, team); };
    return on_team(starts.size(), n_threads, work, kLinesPerThread);
  };
  module.def(name, parse, "text"_a, "starts"_a, "ends"_a, "counts"_a, "n_threads"_a);
}

auto copy_of_rows(const ByteRows& rows, int n_threads) {
  const RowPlaces places{rows.data(), rows.stride(0), static_cast<std::int64_t>(rows.shape(0)),
                         static_cast<std::int64_t>(rows.shape(1))};
  return on_team(rows.shape(0), n_threads,
                 [&](ThreadTeam& team) { return copy_rows(places, team); });
}

WalkedRows walked(Bytes bytes, std::int64_t begin, std::int64_t n_rows,
                  const std::vector<int>& count_sizes, const std::vector<bool>& are_signed,
                  const std::vector<int>& value_sizes, bool is_big_endian) {
  std::vector<ColumnLayout> columns;
  columns.reserve(count_sizes.size());
  for (std::size_t i = 0; i < count_sizes.size(); ++i) {
    columns.push_back({count_sizes[i], are_signed[i], value_sizes[i]});
  }
  return walk_rows(bytes, begin, n_rows, columns, is_big_endian);
}

}  // namespace

void bind_text(nb::module_& module) {
  module.def("scan_lines", &lines_of, "text"_a, "begin"_a, "end"_a, "comment"_a, "n_threads"_a);
  module.def("match_keywords", threaded<kBytesPerThread>(&matched), "text"_a, "starts"_a, "ends"_a,
             "keywords"_a, "any_case"_a, "n_threads"_a);
  define_parse<parse_doubles>(module, "parse_doubles");
  define_parse<parse_integers<std::int32_t>>(module, "parse_integers");
  define_parse<parse_integers<std::int64_t>>(module, "parse_long_integers");
  define_parse<parse_indices<0, std::int32_t>>(module, "parse_corners");
  define_parse<parse_indices<0, std::int64_t>>(module, "parse_long_corners");
  define_parse<parse_indices<1, std::int32_t>>(module, "parse_second_indices");
  define_parse<parse_indices<1, std::int64_t>>(module, "parse_long_second_indices");
  module.def("copy_rows", &copy_of_rows, "rows"_a.noconvert(), "n_threads"_a);
  module.def("copy_runs", threaded(&copy_runs), "bytes"_a, "starts"_a, "sizes"_a, "n_threads"_a);
  module.def("walk_rows", serial(&walked), "bytes"_a, "begin"_a, "n_rows"_a, "count_sizes"_a,
             "are_signed"_a, "value_sizes"_a, "is_big_endian"_a);
}

}  // namespace superfacets
