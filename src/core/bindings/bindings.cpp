// The Python module superfacets._core. Its functions and classes take and return typed arrays, and
// only call the kernels.
#include "bindings/bindings.hpp"

NB_MODULE(_core, module) {
  superfacets::bind_base(module);
  superfacets::bind_mesh(module);
  superfacets::bind_cells(module);
  superfacets::bind_spatial(module);
  superfacets::bind_spectral(module);
  superfacets::bind_clustering(module);
  superfacets::bind_regions(module);
  superfacets::bind_text(module);
}
