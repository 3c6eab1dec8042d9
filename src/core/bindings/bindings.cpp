// The Python module superfacets._core: typed arrays in, arrays out, no logic.
#include "bindings/bindings.hpp"

NB_MODULE(_core, module) {
  superfacets::bind_mesh_stages(module);
  superfacets::bind_cell_stages(module);
  superfacets::bind_files(module);
  superfacets::bind_rivals(module);
}
