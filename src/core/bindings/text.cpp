// Bindings of the kernels that read files. Their headers describe the functions;
// superfacets/io/text.py and superfacets/io/guards.py ensure their preconditions.
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "bindings/bindings.hpp"
#include "text/copy_rows.hpp"
#include "text/parse_numbers.hpp"
#include "text/scan_lines.hpp"
#include "text/walk_rows.hpp"

namespace superfacets {
namespace {

// Text takes longer per byte than other elements, so threads are started for less of it.
constexpr std::int64_t kBytesPerThread = 1 << 16;
constexpr std::int64_t kLinesPerThread = 1 << 12;

using Bytes = Array<std::uint8_t>;
using ByteRows = nb::ndarray<const std::uint8_t, nb::ndim<2>, nb::device::cpu>;

std::string_view as_text(const Bytes& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.shape(0)};
}

auto bind_scan_lines(const Bytes& text, std::int64_t begin, std::int64_t end, int comment,
                     int n_threads) {
  const std::string_view input = as_text(text);
  TextLines lines = on_team(
      end - begin, n_threads,
      [&](ThreadTeam& team) {
        return scan_lines(input, begin, end, static_cast<char>(comment), team);
      },
      kBytesPerThread);
  return std::tuple(to_numpy(std::move(lines.starts)), to_numpy(std::move(lines.ends)),
                    to_numpy(std::move(lines.counts)));
}

auto bind_match_keywords(const Bytes& text, const Array<std::int64_t>& starts,
                         const Array<std::int64_t>& ends, const std::vector<std::string>& keywords,
                         bool any_case, int n_threads) {
  Buffer<std::int8_t> found(starts.shape(0));
  const LineSpans lines{as_text(text), view(starts), view(ends), {}};
  on_team(starts.shape(0), n_threads, [&](ThreadTeam& team) {
    match_keywords(lines.text, lines.starts, lines.ends, keywords, any_case, team, found.span());
  });
  return to_numpy(std::move(found));
}

template <auto kParse>
auto bind_parse(const Bytes& text, const Array<std::int64_t>& starts,
                const Array<std::int64_t>& ends, const Array<std::int32_t>& counts, int n_threads) {
  const LineSpans lines{as_text(text), view(starts), view(ends), view(counts)};
  auto parsed = on_team(
      starts.shape(0), n_threads, [&](ThreadTeam& team) { return kParse(lines, team); },
      kLinesPerThread);
  return std::tuple(to_numpy(std::move(parsed.values)), to_numpy(std::move(parsed.left_out)));
}

template <auto kParse>
void define_parse(nb::module_& module, const char* name) {
  module.def(name, &bind_parse<kParse>, "text"_a.noconvert(), "starts"_a.noconvert(),
             "ends"_a.noconvert(), "counts"_a.noconvert(), "n_threads"_a);
}

auto bind_copy_rows(const ByteRows& rows, int n_threads) {
  const auto n_rows = static_cast<std::int64_t>(rows.shape(0));
  const RowPlaces places{rows.data(), rows.stride(0), static_cast<std::int64_t>(rows.shape(1))};
  Buffer<std::uint8_t> copy(rows.shape(0) * rows.shape(1));
  on_team(rows.shape(0), n_threads,
          [&](ThreadTeam& team) { copy_rows(places, n_rows, team, copy.data()); });
  return to_numpy(std::move(copy));
}

auto bind_copy_runs(const Bytes& bytes, const Array<std::int64_t>& starts,
                    const Array<std::int64_t>& sizes, int n_threads) {
  const auto input = view(bytes);
  const auto runs = std::pair(view(starts), view(sizes));
  return to_numpy(on_team(starts.shape(0), n_threads, [&](ThreadTeam& team) {
    return copy_runs(input, runs.first, runs.second, team);
  }));
}

auto bind_walk_rows(const Bytes& bytes, std::int64_t begin, std::int64_t n_rows,
                    const std::vector<int>& count_sizes, const std::vector<bool>& are_signed,
                    const std::vector<int>& value_sizes, bool is_big_endian) {
  std::vector<ColumnLayout> columns;
  columns.reserve(count_sizes.size());
  for (std::size_t i = 0; i < count_sizes.size(); ++i) {
    columns.push_back({count_sizes[i], are_signed[i], value_sizes[i]});
  }
  const auto input = view(bytes);
  WalkedRows rows =
      without_gil([&] { return walk_rows(input, begin, n_rows, columns, is_big_endian); });
  return std::tuple(to_numpy(std::move(rows.starts)), to_numpy(std::move(rows.lengths)), rows.end,
                    rows.n_whole);
}

}  // namespace

void bind_text(nb::module_& module) {
  module.def("scan_lines", &bind_scan_lines, "text"_a.noconvert(), "begin"_a, "end"_a, "comment"_a,
             "n_threads"_a);
  module.def("match_keywords", &bind_match_keywords, "text"_a.noconvert(), "starts"_a.noconvert(),
             "ends"_a.noconvert(), "keywords"_a, "any_case"_a, "n_threads"_a);
  define_parse<parse_doubles>(module, "parse_doubles");
  define_parse<parse_integers<std::int32_t>>(module, "parse_integers");
  define_parse<parse_integers<std::int64_t>>(module, "parse_long_integers");
  define_parse<parse_corners<std::int32_t>>(module, "parse_corners");
  define_parse<parse_corners<std::int64_t>>(module, "parse_long_corners");
  module.def("copy_rows", &bind_copy_rows, "rows"_a.noconvert(), "n_threads"_a);
  module.def("copy_runs", &bind_copy_runs, "bytes"_a.noconvert(), "starts"_a.noconvert(),
             "sizes"_a.noconvert(), "n_threads"_a);
  module.def("walk_rows", &bind_walk_rows, "bytes"_a.noconvert(), "begin"_a, "n_rows"_a,
             "count_sizes"_a, "are_signed"_a, "value_sizes"_a, "is_big_endian"_a);
}

}  // namespace superfacets
