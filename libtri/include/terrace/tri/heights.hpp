// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <limits>
#include <memory>
#include <span>
#include <type_traits>

#include "terrace/tri/delaunay2.hpp"

/// What gives the vertices of a planar triangulation their heights.

namespace terrace::tri {

using Point2 = std::array<double, 2>;

/// Anything with a member height(VertexId), such as MultiresolutionModel.
template <class T>
concept HasHeights = requires(const T& t, VertexId vertex) {
  { t.height(vertex) } -> std::convertible_to<double>;
};

/// A function from vertex to height.
template <class T>
concept HeightFunction = std::is_invocable_r_v<double, const T&, VertexId>;

/// The height of a vertex, from an array indexed by slot(vertex), from a function, or from an
/// object with a member height(VertexId). It refers to what it was made from, as a std::span does,
/// so it is for parameters. With several threads the function is called from all of them at once.
class Heights {
 public:
  template <class T>
  requires std::convertible_to<const T&, std::span<const double>> Heights(const T& by_slot)
      : values_(std::span<const double>(by_slot).data()),
        slots_(std::span<const double>(by_slot).size()) {}
  template <class T>
  requires(HeightFunction<T> && !std::is_same_v<T, Heights>) Heights(const T& function)
      : object_(std::addressof(function)), call_([](const void* object, VertexId vertex) {
          return static_cast<double>((*static_cast<const T*>(object))(vertex));
        }) {}
  template <HasHeights T>
  Heights(const T& model)
      : object_(std::addressof(model)), call_([](const void* object, VertexId vertex) {
          return static_cast<double>(static_cast<const T*>(object)->height(vertex));
        }) {}

  /// Requires slot(vertex) < slots().
  double operator()(VertexId vertex) const {
    return call_ == nullptr ? values_[slot(vertex)] : call_(object_, vertex);
  }
  /// The length of the array; no limit for functions.
  [[nodiscard]] std::size_t slots() const { return slots_; }

 private:
  const double* values_ = nullptr;
  const void* object_ = nullptr;
  double (*call_)(const void*, VertexId) = nullptr;
  std::size_t slots_ = std::numeric_limits<std::size_t>::max();
};

}  // namespace terrace::tri
