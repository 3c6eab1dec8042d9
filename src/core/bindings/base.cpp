// Bindings of the base layer, and properties of the build (for tests).

#include "base/elementary.hpp"
#include "base/lists.hpp"
#include "bindings/bindings.hpp"

namespace superfacets {
namespace {

Buffer<double> arctangents_of(Doubles y, Doubles x, int instruction_set) {
  Buffer<double> angles(y.size());
  arctangents(y, x, angles.span(), static_cast<InstructionSet>(instruction_set));
  return angles;
}

Buffer<double> exponentials_of(Doubles x) {
  Buffer<double> powers(x.size());
  exponentials(x, powers.span());
  return powers;
}

// Rounds to single precision.
Buffer<float> narrowed(Doubles values, ThreadTeam& team) {
  Buffer<float> found(values.size());
  team.for_each_index(std::ssize(values),
                      [&](std::int64_t i) { found[i] = static_cast<float>(values[i]); });
  return found;
}

// Python context manager that creates a C++ scope object on entry and destroys it on exit. Entry
// and exit must be on the same thread.
template <typename Scope, typename... Settings>
class Context {
 public:
  explicit Context(Settings... settings) : settings_(settings...) {}
  void enter() {
    std::apply([&](auto... settings) { scope_.emplace(settings...); }, settings_);
  }
  void leave() { scope_.reset(); }

  template <typename... Names>
  static void bind(nb::module_& module, const char* name, const Names&... names) {
    nb::class_<Context>(module, name)
        .def(nb::init<Settings...>(), names...)
        .def("__enter__", &Context::enter)
        .def(
            "__exit__", [](Context& context, const nb::args&) { context.leave(); },
            nb::sig("def __exit__(self, *exception: object) -> None"));
  }

 private:
  std::tuple<Settings...> settings_;
  std::optional<Scope> scope_;
};

}  // namespace

void bind_base(nb::module_& module) {
  module.def("has_assertions", [] { return kHasAssertions; });
  module.def("best_instruction_set", [] { return static_cast<int>(best_instruction_set()); });
  Context<TeamScope>::bind(module, "Workspace");
  module.def("arctangents", serial(&arctangents_of), "y"_a, "x"_a, "instruction_set"_a);
  module.def("sum_of", threaded(&sum_of), "values"_a, "n_threads"_a);
  module.def("narrowed", threaded(&narrowed), "values"_a, "n_threads"_a);
  module.def("exponentials", serial(&exponentials_of), "x"_a);
}

}  // namespace superfacets
