// The Python module superfacets_vsa: Variational Shape Approximation, which is only used for
// comparisons. The functions are documented in vsa.hpp. Their preconditions are checked by
// research/baselines/vsa.py.

#include "bindings/bindings.hpp"
#include "vsa.hpp"

namespace superfacets {
namespace {

void make_proxy_regions(ProxyRegions* self, Points vertices, Triangles faces, Doubles areas,
                        Offsets offsets, Integers neighbors, ProxyMetric metric, Integers seeds) {
  without_gil([&] {
    new (self)
        ProxyRegions(make_proxy_surface(vertices, faces, areas, offsets, neighbors), metric, seeds);
  });
}

}  // namespace

void bind_vsa(nb::module_& module) {
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
}

}  // namespace superfacets

NB_MODULE(superfacets_vsa, module) {
  superfacets::bind_vsa(module);
}
