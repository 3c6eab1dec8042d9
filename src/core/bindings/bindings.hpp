// Common code of all bindings: converts arrays to spans, runs kernels without the GIL on a team of
// threads, and converts results to arrays that own their memory.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/tuple.h>

#include <tuple>

#include "base/buffer.hpp"
#include "base/team_scope.hpp"
#include "base/types.hpp"

namespace superfacets {

namespace nb = nanobind;
using namespace nb::literals;

template <typename T>
using Array = nb::ndarray<const T, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
template <typename T>
using WritableArray = nb::ndarray<T, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
template <typename T, int kColumns>
using Rows = nb::ndarray<const T, nb::shape<-1, kColumns>, nb::c_contig, nb::device::cpu>;
template <typename T>
using Table = nb::ndarray<const T, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

using Points = std::span<const Point>;
using Triangles = std::span<const Triangle>;
using Tets = std::span<const Tet>;
using Doubles = std::span<const double>;
using Floats = std::span<const float>;
using Bytes = std::span<const std::uint8_t>;
using Integers = std::span<const std::int32_t>;  // indices of cells or vertices, or labels
using Offsets = std::span<const std::int64_t>;

// NumPy array type for a span of elements: (n, 3) or (n, 4) for points, triangles and tetrahedra.
template <typename T>
struct ArrayOf {
  using Type = Array<T>;
};
template <>
struct ArrayOf<Point> {
  using Type = Rows<double, 3>;
};
template <>
struct ArrayOf<Triangle> {
  using Type = Rows<Vertex, 3>;
};
template <>
struct ArrayOf<Tet> {
  using Type = Rows<Vertex, 4>;
};

}  // namespace superfacets

// Accepts only arrays of the exact type, because a conversion would silently copy the array. The
// caster keeps the array alive until the call returns.
template <typename T>
struct nanobind::detail::type_caster<std::span<const T>> {
  using Held = make_caster<typename superfacets::ArrayOf<T>::Type>;
  NB_TYPE_CASTER(std::span<const T>, Held::Name)

  template <typename Flags>  // the type of flags depends on the version of nanobind
  bool from_python(handle source, Flags flags, cleanup_list* cleanup) noexcept {
    const auto no_conversion = static_cast<Flags>(cast_flags::convert);
    if (!held.from_python(source, static_cast<Flags>(flags & ~no_conversion), cleanup))
      return false;
    value = {reinterpret_cast<const T*>(held.value.data()), held.value.shape(0)};
    return true;
  }

  Held held;
};

template <>
struct nanobind::detail::type_caster<superfacets::Point> {
  using Numbers = std::tuple<double, double, double>;
  NB_TYPE_CASTER(superfacets::Point, make_caster<Numbers>::Name)

  template <typename Flags>
  bool from_python(handle source, Flags flags, cleanup_list* cleanup) noexcept {
    make_caster<Numbers> numbers;
    if (!numbers.from_python(source, flags, cleanup)) return false;
    const auto [x, y, z] = numbers.operator Numbers();
    value = {x, y, z};
    return true;
  }
  static handle from_cpp(const superfacets::Point& p, rv_policy policy,
                         cleanup_list* cleanup) noexcept {
    return make_caster<Numbers>::from_cpp(Numbers(p.x, p.y, p.z), policy, cleanup);
  }
};

namespace superfacets {

// The numbers of a table, row by row.
template <typename T>
std::span<const T> values_of(const Table<T>& table) {
  return {table.data(), table.size()};
}

// Moves a vector or a buffer to the heap and returns it as an array whose capsule deletes it.
template <typename List>
auto to_numpy(List&& list) {
  using Element = typename std::decay_t<List>::value_type;
  auto* owned = new std::decay_t<List>(std::forward<List>(list));
  if constexpr (requires { owned->reserve(1); }) {
    owned->reserve(1);  // numpy requires a valid pointer, even for an empty array
  }
  const nb::capsule owner(owned,
                          [](void* p) noexcept { delete static_cast<std::decay_t<List>*>(p); });
  const std::size_t size = owned->size();
  if constexpr (std::is_same_v<Element, Point>) {
    using NewRows = nb::ndarray<nb::numpy, double, nb::shape<-1, 3>, nb::c_contig>;
    return NewRows(reinterpret_cast<double*>(owned->data()), {size, 3}, owner);
  } else if constexpr (std::is_same_v<Element, Triangle>) {
    using NewTriangles = nb::ndarray<nb::numpy, Vertex, nb::shape<-1, 3>, nb::c_contig>;
    return NewTriangles(reinterpret_cast<Vertex*>(owned->data()), {size, 3}, owner);
  } else {
    using NewArray = nb::ndarray<nb::numpy, Element, nb::ndim<1>, nb::c_contig>;
    return NewArray(owned->data(), {size}, owner);
  }
}

// A type that converts to any type, used to count the members of a struct.
struct Anything {
  template <typename T>
  operator T() const;  // NOLINT(google-explicit-constructor)
};

// Returns the members of a struct as a tuple of references. Structs with 2 to 6 members are
// supported.
template <typename Struct>
auto members(Struct&& from) {
  using S = std::decay_t<Struct>;
  using A = Anything;
  if constexpr (requires { S{A(), A(), A(), A(), A(), A()}; }) {
    auto& [a, b, c, d, e, f] = from;
    return std::tie(a, b, c, d, e, f);
  } else if constexpr (requires { S{A(), A(), A(), A(), A()}; }) {
    auto& [a, b, c, d, e] = from;
    return std::tie(a, b, c, d, e);
  } else if constexpr (requires { S{A(), A(), A(), A()}; }) {
    auto& [a, b, c, d] = from;
    return std::tie(a, b, c, d);
  } else if constexpr (requires { S{A(), A(), A()}; }) {
    auto& [a, b, c] = from;
    return std::tie(a, b, c);
  } else {
    auto& [a, b] = from;
    return std::tie(a, b);
  }
}

// Converts a list of structs to one array per chosen member.
template <typename Struct, typename... Member>
auto columns(const std::vector<Struct>& rows, Member Struct::*... chosen) {
  const auto column = [&]<typename Type>(Type Struct::* member) {
    std::vector<Type> values;
    values.reserve(rows.size());
    for (const Struct& row : rows) values.push_back(row.*member);
    return values;
  };
  return std::tuple(column(chosen)...);
}

// Converts a result for Python: lists become arrays, tuples and structs become tuples, and other
// values do not change.
template <typename Result>
auto to_python(Result&& result) {
  using Type = std::decay_t<Result>;
  const auto each = [](auto&... values) { return std::tuple(to_python(std::move(values))...); };
  if constexpr (requires { typename Type::value_type; }) {
    return to_numpy(std::forward<Result>(result));
  } else if constexpr (requires { std::tuple_size<Type>::value; }) {
    return std::apply(each, result);
  } else if constexpr (std::is_class_v<Type> && std::is_aggregate_v<Type> &&
                       !std::is_same_v<Type, Point>) {
    return std::apply(each, members(result));
  } else {
    return std::forward<Result>(result);
  }
}

// Calls work() with the GIL released, and converts its result with the GIL held.
template <typename Work>
auto without_gil(const Work& work) {
  const auto call = [&] {
    const nb::gil_scoped_release release;
    return work();
  };
  if constexpr (std::is_void_v<decltype(work())>) {
    call();
  } else {
    return to_python(call());
  }
}

// Calls work(team) with the GIL released, and converts its result. The size of the team depends on
// the number n of elements (see useful_threads), and is at most n_threads.
template <typename Work>
auto on_team(std::size_t n, int n_threads, const Work& work,
             std::int64_t min_per_thread = kMinPerThread) {
  return without_gil([&] {
    TeamLease lease(useful_threads(static_cast<std::int64_t>(n), n_threads, min_per_thread));
    return work(lease.team());
  });
}

// Number of elements of an argument, from which the number of threads is chosen. The number is 0
// for a scalar.
template <typename Argument>
std::size_t size_of(const Argument& argument) {
  if constexpr (requires { argument.n_cells(); }) {
    return argument.n_cells();
  } else if constexpr (requires { argument.graph().n_cells(); }) {
    return argument.graph().n_cells();
  } else if constexpr (requires { argument.size(); }) {
    return argument.size();
  } else {
    return 0;
  }
}

// The types of the parameters of a function or lambda.
template <typename Function>
struct Parameters : Parameters<decltype(&Function::operator())> {};
template <typename R, typename... A>
struct Parameters<R (*)(A...)> {
  using Types = std::tuple<A...>;
};
template <typename C, typename R, typename... A>
struct Parameters<R (C::*)(A...) const> : Parameters<R (*)(A...)> {};

// Converts a kernel whose last parameter is a team to a function whose last parameter is n_threads.
template <std::int64_t kPerThread = kMinPerThread, typename Kernel>
auto threaded(const Kernel& kernel) {
  using Types = typename Parameters<Kernel>::Types;
  return [&]<std::size_t... I>(std::index_sequence<I...>) {
    return [kernel](std::tuple_element_t<I, Types>... arguments, int n_threads) {
      const std::size_t n = std::max({size_of(arguments)...});
      const auto work = [&](ThreadTeam& team) { return kernel(arguments..., team); };
      return on_team(n, n_threads, work, kPerThread);
    };
  }(std::make_index_sequence<std::tuple_size_v<Types> - 1>());
}

// Converts a kernel that runs on one thread to a function that releases the GIL.
template <typename Kernel>
auto serial(const Kernel& kernel) {
  using Types = typename Parameters<Kernel>::Types;
  return [&]<std::size_t... I>(std::index_sequence<I...>) {
    return [kernel](std::tuple_element_t<I, Types>... arguments) {
      return without_gil([&] { return kernel(arguments...); });
    };
  }(std::make_index_sequence<std::tuple_size_v<Types>>());
}

// Adds the constructor of a class that refers to the memory of its array arguments. The Python
// object keeps these arrays alive.
template <typename Class, typename Make, typename... Names>
void def_view(Class& bound, const Make& make, const Names&... names) {
  [&]<std::size_t... I>(std::index_sequence<I...>) {
    bound.def("__init__", make, names..., nb::keep_alive<1, 2 + I>()...);
  }(std::make_index_sequence<sizeof...(Names)>());
}

void bind_base(nb::module_& module);        // sums, scopes, elementary functions
void bind_mesh(nb::module_& module);        // stage 0: checks and geometry of meshes
void bind_cells(nb::module_& module);       // stages 1 and 2: graphs of cells, weights of arcs
void bind_spatial(nb::module_& module);     // spatial search and sorting
void bind_spectral(nb::module_& module);    // diffusion and eigenvectors
void bind_clustering(nb::module_& module);  // stages 3 and 4: seeds and regions
void bind_regions(nb::module_& module);     // stage 5: borders and region graphs
void bind_text(nb::module_& module);

}  // namespace superfacets
