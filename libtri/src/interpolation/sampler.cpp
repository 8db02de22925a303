// SPDX-License-Identifier: Apache-2.0
#include "sampler.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <type_traits>

#include <CGAL/Exact_rational.h>
#include <boost/multiprecision/gmp.hpp>

#include "bounded_number.hpp"
#include "voronoi_cell.hpp"

namespace terrace::tri::planar {

using Rational = CGAL::Exact_rational;

template <>
struct Rounded<Rational> {
  static constexpr bool kShortens = true;
  static double of(const Rational& value) { return CGAL::to_double(value); }
  static Rational shorten(const Rational& value) {
    using Integer = boost::multiprecision::mpz_int;
    Integer top = numerator(value), bottom = denominator(value);
    if (top == 0) return value;
    const auto bits = [](const Integer& i) { return static_cast<int>(msb(abs(i))); };
    if (bits(top) + bits(bottom) < 2 * kShortBits) return value;
    const int shift = kShortBits + bits(bottom) - bits(top);
    (shift > 0 ? top : bottom) <<= std::abs(shift);
    Integer scale = 1;
    scale <<= std::abs(shift);
    const Integer quotient = top / bottom;
    return shift > 0 ? Rational(quotient, scale) : Rational(Integer(quotient * scale));
  }
};

namespace {

/// Twice the areas of the triangles of p and two corners, as shares of their sum, if they are
/// accurate. `corner` is counter-clockwise.
template <class Number>
bool barycentric(const Query& p, const std::array<Query, 3>& corner,
                 std::array<double, 3>& weights) {
  std::array<std::array<Number, 2>, 3> at;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 2; ++k) at[i][k] = Number(corner[i][k]) - Number(p[k]);
  std::array<Number, 3> area;
  Number size = 0;
  Number total = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto& b = at[(i + 1) % 3];
    const auto& c = at[(i + 2) % 3];
    const Number left = b[0] * c[1];
    const Number right = b[1] * c[0];
    area[i] = left - right;
    total += area[i];
    if constexpr (std::is_same_v<Number, double>) size += std::abs(left) + std::abs(right);
  }
  if constexpr (std::is_same_v<Number, double>) {
    const bool accurate = size * (4 * 0x1p-53 / kTolerance) < total;
    if (!accurate || !(total > kMinSquare) || !(size < kGreatestSquare)) return false;
  }
  for (std::size_t i = 0; i < 3; ++i) weights[i] = Rounded<Number>::of(Number(area[i] / total));
  return true;
}

/// Twice the area of a triangle, and that area times its gradient.
template <class Number>
struct GradientSum {
  Number x = 0;
  Number y = 0;
  Number area = 0;
  Number size = 0;  ///< for doubles: the sum of absolute values of the products in `area`

  void add(const std::array<Query, 3>& corner, const std::array<double, 3>& height) {
    const Number bx = Number(corner[1][0]) - Number(corner[0][0]);
    const Number by = Number(corner[1][1]) - Number(corner[0][1]);
    const Number cx = Number(corner[2][0]) - Number(corner[0][0]);
    const Number cy = Number(corner[2][1]) - Number(corner[0][1]);
    const Number bh = Number(height[1]) - Number(height[0]);
    const Number ch = Number(height[2]) - Number(height[0]);
    x += bh * cy - ch * by;
    y += ch * bx - bh * cx;
    area += bx * cy - by * cx;
    if constexpr (std::is_same_v<Number, double>) size += std::abs(bx * cy) + std::abs(by * cx);
  }
  [[nodiscard]] Gradient gradient() const {
    return {Rounded<Number>::of(Number(x / area)), Rounded<Number>::of(Number(y / area))};
  }
};

}  // namespace

template <class Kernel>
struct Sampler<Kernel>::Exact {
  VoronoiCell<BoundedNumber> bounded;
  VoronoiCell<Rational> cell;
};

template <class Kernel>
Sampler<Kernel>::Sampler(const Mesh<Kernel>& mesh) : mesh_(mesh) {
  start_at(kNone);
}
template <class Kernel>
Sampler<Kernel>::~Sampler() = default;

template <class Kernel>
auto Sampler<Kernel>::exact() -> Exact& {
  if (exact_ == nullptr) exact_ = std::make_unique<Exact>();
  return *exact_;
}

template <class Kernel>
void Sampler<Kernel>::start_at(std::uint32_t vertex) {
  if (!mesh_.flat) last_ = mesh_.incident[vertex == kNone ? mesh_.last_vertex : vertex];
}

template <class Kernel>
std::span<const VertexWeight> Sampler<Kernel>::compute_weights(const Query& p,
                                                               Interpolation method) {
  weights_.clear();
  if (method == Interpolation::nearest) {
    const std::uint32_t nearest = nearest_vertex(mesh_, p, last_);
    if (nearest != kNone) weights_.push_back({VertexId{nearest}, 1});
    return weights_;
  }
  const QueryPlace place = find_place(mesh_, p, last_);
  switch (place.kind) {
    case QueryPlace::kOutside:
      break;
    case QueryPlace::kVertex:
      weights_.push_back({VertexId{place.corner[0]}, 1});
      break;
    case QueryPlace::kHullEdge:
      weigh_edge(p, place.corner[0], place.corner[1]);
      break;
    case QueryPlace::kInside:
      if (method == Interpolation::linear) {
        weigh_triangle(p, place.triangle);
      } else {
        weigh_neighbours(p, place.triangle);
      }
      break;
  }
  return weights_;
}

template <class Kernel>
void Sampler<Kernel>::divide_by_sum() {
  double sum = 0;
  for (VertexWeight& w : weights_) {
    w.weight = std::max(w.weight, 0.0);
    sum += w.weight;
  }
  for (VertexWeight& w : weights_) w.weight /= sum;
}

template <class Kernel>
void Sampler<Kernel>::weigh_edge(const Query& p, std::uint32_t a, std::uint32_t b) {
  const Query from = to_query(mesh_.point[a]);
  const Query to = to_query(mesh_.point[b]);
  // Uses halves if differences of finite doubles overflow.
  const bool huge = !std::isfinite(to[0] - from[0]) || !std::isfinite(to[1] - from[1]);
  const auto difference = [&](double u, double v) {
    return std::abs(huge ? u / 4 - v / 4 : u - v);
  };
  const std::size_t axis = difference(to[0], from[0]) >= difference(to[1], from[1]) ? 0 : 1;
  weights_.push_back({VertexId{a}, difference(to[axis], p[axis])});
  weights_.push_back({VertexId{b}, difference(p[axis], from[axis])});
  divide_by_sum();
}

template <class Kernel>
void Sampler<Kernel>::weigh_triangle(const Query& p, std::uint32_t t) {
  const auto& [a, b, c] = mesh_.triangle[t].corner;
  const std::array<Query, 3> corner{to_query(mesh_.point[a]), to_query(mesh_.point[b]),
                                    to_query(mesh_.point[c])};
  std::array<double, 3> weights{};
  if (!barycentric<double>(p, corner, weights)) barycentric<Rational>(p, corner, weights);
  weights_ = {{VertexId{a}, weights[0]}, {VertexId{b}, weights[1]}, {VertexId{c}, weights[2]}};
  divide_by_sum();
}

template <class Kernel>
bool Sampler<Kernel>::measure(const Query& p) {
  cell_.measure(cavity_, p);
  return cell_.accurate();
}

template <class Kernel>
template <class Number>
bool Sampler<Kernel>::compute_weights(const VoronoiCell<Number>& cell) {
  weights_.clear();
  for (std::size_t i = 0; i < cell.area.size(); ++i) {
    double weight = 0;
    if constexpr (std::is_same_v<Number, double>) {
      weight = cell.area[i];
    } else {
      weight = Rounded<Number>::of(Number(cell.area[i] / cell.total));
    }
    if (std::isnan(weight)) return false;
    weights_.push_back({VertexId{cavity_.corner[i].vertex}, weight});
  }
  divide_by_sum();
  return true;
}

template <class Kernel>
void Sampler<Kernel>::weigh_neighbours(const Query& p, std::uint32_t t) {
  find_cavity(mesh_, p, t, cavity_);
  if (measure(p)) {
    compute_weights(cell_);
    return;
  }
  exact().bounded.measure(cavity_, p);
  if (compute_weights(exact().bounded)) return;
  exact().cell.measure(cavity_, p);
  compute_weights(exact().cell);
}

template <class Kernel>
Gradient Sampler<Kernel>::gradient_of_cell(const Query& p, const Heights& heights,
                                           VertexId centre) {
  const bool on_vertex = centre != kNoVertex;
  if (!measure(p) || !cell_.differentiate(cavity_, on_vertex, slopes_)) {
    exact().bounded.measure(cavity_, p);
    if (!exact().bounded.differentiate(cavity_, on_vertex, slopes_)) {
      exact().cell.measure(cavity_, p);
      exact().cell.differentiate(cavity_, on_vertex, slopes_);
    }
  }
  // The slopes of the weights add up to zero, so heights may be taken relative to any one of them,
  // which keeps the digits of their differences.
  const double base = heights(on_vertex ? centre : VertexId{cavity_.corner[0].vertex});
  Gradient result{0, 0};
  for (std::size_t i = 0; i < slopes_.size(); ++i) {
    const double rise = heights(VertexId{cavity_.corner[i].vertex}) - base;
    result.x += slopes_[i][0] * rise;
    result.y += slopes_[i][1] * rise;
  }
  return result;
}

template <class Kernel>
void Sampler<Kernel>::find_triangles(const Query& p, const QueryPlace& place) {
  triangles_.clear();
  if (place.kind == QueryPlace::kVertex) {
    for_each_triangle_at(mesh_, place.corner[0], [&](std::uint32_t t, std::uint32_t) {
      if (!has_ghost(mesh_.triangle[t].corner)) triangles_.push_back(t);
    });
    return;
  }
  triangles_.push_back(place.triangle);
  const Triangle& t = mesh_.triangle[place.triangle];
  for (std::uint32_t i = 0; i < 3; ++i) {
    const std::uint32_t neighbour = triangle_of(t.mate[i]);
    if (!has_ghost(mesh_.triangle[neighbour].corner) &&
        DoubleKernel::orientation(to_query(mesh_.point[t.corner[next_index(i)]]),
                                  to_query(mesh_.point[t.corner[previous_index(i)]]), p) == 0)
      triangles_.push_back(neighbour);
  }
}

template <class Kernel>
Gradient Sampler<Kernel>::gradient_of_triangles(const Heights& heights) {
  GradientSum<double> sum;
  const auto add_all = [&](auto& target) {
    for (const std::uint32_t t : triangles_) {
      std::array<Query, 3> corner;
      std::array<double, 3> height{};
      for (std::size_t i = 0; i < 3; ++i) {
        const std::uint32_t v = mesh_.triangle[t].corner[i];
        corner[i] = to_query(mesh_.point[v]);
        height[i] = heights(VertexId{v});
        if (!std::isfinite(height[i])) return false;
      }
      target.add(corner, height);
    }
    return true;
  };
  if (!add_all(sum)) return {};
  const bool accurate = sum.size * (4 * 0x1p-53 / kTolerance) < sum.area;
  if (accurate && sum.area > kMinSquare && sum.size < kGreatestSquare) return sum.gradient();
  GradientSum<Rational> exact_sum;
  add_all(exact_sum);
  return exact_sum.gradient();
}

template <class Kernel>
Gradient Sampler<Kernel>::gradient(const Query& p, const Heights& heights, GradientFrom from) {
  const QueryPlace place = find_place(mesh_, p, last_);
  if (mesh_.flat || place.kind == QueryPlace::kOutside) return {};
  if (from == GradientFrom::natural_neighbours) {
    if (place.kind == QueryPlace::kInside) {
      find_cavity(mesh_, p, place.triangle, cavity_);
      return gradient_of_cell(p, heights, kNoVertex);
    }
    if (place.kind == QueryPlace::kVertex && find_link(mesh_, place.corner[0], cavity_))
      return gradient_of_cell(p, heights, VertexId{place.corner[0]});
  }
  find_triangles(p, place);
  return gradient_of_triangles(heights);
}

template class Sampler<IntKernel>;
template class Sampler<DoubleKernel>;

}  // namespace terrace::tri::planar
