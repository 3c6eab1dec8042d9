// Bindings of methods to compare with. What each function does stands in its header; what it may
// assume, in superfacets/_validate.py.
#include <new>

#include "base/threads.hpp"
#include "bindings/bindings.hpp"
#include "paths/path_lengths.hpp"
#include "study/vsa.hpp"

namespace superfacets {
namespace {

// Paths from each of so many cells take longer than to start a thread.
constexpr std::int64_t kMinCellsPerThread = 64;

void bind_proxy_regions(ProxyRegions* self, const Rows<double>& vertices, const Rows<Vertex>& faces,
                        const Array<double>& areas, const Array<std::int64_t>& offsets,
                        const Array<Face>& neighbors, ProxyMetric metric,
                        const Array<Face>& seeds) {
  const auto mesh = std::pair(points(vertices), triangles(faces));
  const auto arcs = std::pair(view(offsets), view(neighbors));
  const auto measures = view(areas);
  const auto first = view(seeds);
  without_gil([&] {
    ProxySurface surface =
        make_proxy_surface(mesh.first, mesh.second, measures, arcs.first, arcs.second);
    return new (self) ProxyRegions(std::move(surface), metric, first);
  });
}

std::int64_t bind_relax(ProxyRegions& regions) {
  return without_gil([&] { return regions.relax(); });
}

void bind_insert(ProxyRegions& regions) {
  without_gil([&] { regions.insert(); });
}

auto bind_proxy_labels(const ProxyRegions& regions) {
  return to_numpy(std::vector(regions.labels()));
}

auto bind_proxy_seeds(const ProxyRegions& regions) {
  return to_numpy(std::vector(regions.seeds()));
}

auto bind_path_lengths(const OrderedGraph& graph, const Array<Cell>& sources, double unit,
                       int n_threads) {
  const auto input = view(sources);
  return to_numpy(on_team(
      graph.n_cells(), n_threads,
      [&](ThreadTeam& team) { return path_lengths(graph, input, unit, team); },
      kMinCellsPerThread));
}

auto bind_path_lengths_within(const OrderedGraph& graph, double reach, double unit, int n_threads) {
  SparseRows rows = on_team(
      graph.n_cells(), n_threads,
      [&](ThreadTeam& team) { return path_lengths_within(graph, reach, unit, team); },
      kMinCellsPerThread);
  return std::tuple(to_numpy(std::move(rows.offsets)), to_numpy(std::move(rows.columns)),
                    to_numpy(std::move(rows.values)));
}

}  // namespace

void bind_study(nb::module_& module) {
  nb::enum_<ProxyMetric>(module, "ProxyMetric")
      .value("L2", ProxyMetric::kL2)
      .value("L21", ProxyMetric::kL21);
  nb::class_<ProxyRegions>(module, "ProxyRegions")
      .def("__init__", &bind_proxy_regions, "vertices"_a.noconvert(), "faces"_a.noconvert(),
           "areas"_a.noconvert(), "offsets"_a.noconvert(), "neighbors"_a.noconvert(), "metric"_a,
           "seeds"_a.noconvert())
      .def_prop_ro("n_regions", &ProxyRegions::n_regions)
      .def("relax", &bind_relax)
      .def("insert", &bind_insert)
      .def("labels", &bind_proxy_labels)
      .def("seeds", &bind_proxy_seeds);
  module.def("path_lengths", &bind_path_lengths, "graph"_a, "sources"_a.noconvert(), "unit"_a,
             "n_threads"_a);
  module.def("path_lengths_within", &bind_path_lengths_within, "graph"_a, "reach"_a, "unit"_a,
             "n_threads"_a);
}

}  // namespace superfacets
