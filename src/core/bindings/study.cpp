// Bindings for comparisons: another segmentation method, and path lengths. The functions are
// documented in the headers. Their preconditions are checked by superfacets/study.

#include "bindings/bindings.hpp"
#include "paths/path_lengths.hpp"
#include "study/vsa.hpp"

namespace superfacets {
namespace {

// Minimum number of source cells per thread. Computing the paths from this number of sources takes
// longer than starting a thread.
constexpr std::int64_t kMinSources = 64;

void make_proxy_regions(ProxyRegions* self, Points vertices, Triangles faces, Doubles areas,
                        Offsets offsets, Integers neighbors, ProxyMetric metric, Integers seeds) {
  without_gil([&] {
    new (self)
        ProxyRegions(make_proxy_surface(vertices, faces, areas, offsets, neighbors), metric, seeds);
  });
}

}  // namespace

void bind_study(nb::module_& module) {
  nb::enum_<ProxyMetric>(module, "ProxyMetric")
      .value("L2", ProxyMetric::kL2)
      .value("L21", ProxyMetric::kL21);
  nb::class_<ProxyRegions>(module, "ProxyRegions")
      .def("__init__", &make_proxy_regions, "vertices"_a, "faces"_a, "areas"_a, "offsets"_a,
           "neighbors"_a, "metric"_a, "seeds"_a)
      .def_prop_ro("n_regions", &ProxyRegions::n_regions)
      .def("relax", serial([](ProxyRegions& regions) { return regions.relax(); }))
      .def("insert", serial([](ProxyRegions& regions) { regions.insert(); }))
      .def("labels",
           serial([](const ProxyRegions& regions) { return std::vector(regions.labels()); }))
      .def("seeds",
           serial([](const ProxyRegions& regions) { return std::vector(regions.seeds()); }));
  module.def("path_lengths", threaded<kMinSources>(&path_lengths), "graph"_a, "sources"_a, "unit"_a,
             "n_threads"_a);
  module.def("path_lengths_within", threaded<kMinSources>(&path_lengths_within), "graph"_a,
             "reach"_a, "unit"_a, "n_threads"_a);
}

}  // namespace superfacets
