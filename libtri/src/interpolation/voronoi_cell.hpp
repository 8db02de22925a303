// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <type_traits>
#include <vector>

#include "bounded_number.hpp"
#include "cavity.hpp"

/// The Voronoi cell that a query would get, and the areas that it would take from its neighbours.
///
/// The cell's corners are the centres of the circles through the query and the edges of the
/// cavity's rim. Inside the cell are the centres of the cavity's triangles, which are corners of
/// the existing cells. The area that the query takes from corner v is a polygon: the cell's side
/// towards v and the centres of the triangles at v. Each edge of such polygons belongs to two of
/// them and is dual to an edge of the cavity. It adds to one area what it subtracts from the other.

namespace terrace::tri::planar {

/// Greatest accepted error of weights computed in double.
inline constexpr double kTolerance = 1e-11;
/// Number of roundings that add up in a weight, besides those counted by VoronoiCell::error.
inline constexpr double kRoundings = 4;
/// Limits of squared sizes, so that products of four lengths neither overflow nor lose bits.
inline constexpr double kMinSquare = 1e-130;
inline constexpr double kGreatestSquare = 1e130;

/// Rounds to a double (NaN: the number is not known precisely enough) or, if it kShortens, to a
/// relative 2^-kShortBits. Specialised for rational numbers where they are used.
inline constexpr int kShortBits = 512;
template <class Number>
struct Rounded;
template <>
struct Rounded<BoundedNumber> {
  static constexpr bool kShortens = false;
  static double of(const BoundedNumber& value) { return value.rounded(); }
};
template <>
struct Rounded<double> {
  static constexpr bool kShortens = false;
  static double of(double value) { return value; }
};
/// Longer sums of exact quotients take too much time, as their digits grow with every term.
inline constexpr std::size_t kLongSum = 32;

/// Number = double, BoundedNumber, or exact rationals.
template <class Number>
struct VoronoiCell {
  struct Vector {
    Number x;
    Number y;
  };
  std::vector<Vector> at;      ///< corners relative to the query
  std::vector<Vector> centre;  ///< circumcentres of triangles relative to the query
  std::vector<Vector> round;   ///< corners of the cell by edge of the rim
  std::vector<Number> area;    ///< twice the area taken from each corner
  Number total = 0;            ///< twice the cell's area
  /// For doubles: the sum of squared errors of centres, in units of rounding. An estimate.
  Number error = 0;
  Number extent = 0;  ///< for doubles: the sum of squares of `round`

  /// Measures the cell, exactly with rationals. For cells of more than kLongSum sides the rationals
  /// of the corners are shortened if the total keeps kShortBits / 2 certain bits.
  void measure(const Cavity& cavity, const Query& p);
  /// For doubles, after measure(): true if the weights will be accurate to kTolerance.
  [[nodiscard]] bool accurate() const;
  /// Computes the derivatives of the weights area / total by the query's coordinates, per corner.
  /// On a vertex (find_link()) computes numbers s(i) such that the sum of s(i) * (height(i) -
  /// height of the vertex) is the mean gradient over the cell. Must be called after measure().
  /// Returns false if they are not accurate to kTolerance, or if a bounded number leaves one
  /// undecided.
  bool differentiate(const Cavity& cavity, bool on_vertex,
                     std::vector<std::array<double, 2>>& slopes);

 private:
  static Number cross(const Vector& a, const Vector& b) { return a.x * b.y - a.y * b.x; }
  static Number square(const Vector& a) { return a.x * a.x + a.y * a.y; }
  /// The point equidistant from the origin, b and c, which are counter-clockwise.
  Vector circumcentre(const Vector& b, const Vector& c);
  void measure(const Cavity& cavity, const Query& p, bool shortens);
  static Vector shorten(const Vector& a) {
    if constexpr (!Rounded<Number>::kShortens)
      return a;
    else
      return {Rounded<Number>::shorten(a.x), Rounded<Number>::shorten(a.y)};
  }

  bool shortens_ = false;
  std::vector<Vector> slope_;
};

template <class Number>
auto VoronoiCell<Number>::circumcentre(const Vector& b, const Vector& c) -> Vector {
  const Number bb = square(b);
  const Number cc = square(c);
  const Number half = Number(0.5) / cross(b, c);
  const Vector result{(bb * c.y - cc * b.y) * half, (cc * b.x - bb * c.x) * half};
  // The cross product has a relative error of 1 / sin of the angle, and so does the radius. The
  // error is a sum, so it is NaN if one of its terms is.
  if constexpr (std::is_same_v<Number, double>) error += bb * cc * half * half * square(result);
  return result;
}

template <class Number>
void VoronoiCell<Number>::measure(const Cavity& cavity, const Query& p) {
  constexpr bool kShortens = Rounded<Number>::kShortens;
  measure(cavity, p, kShortens && cavity.rim.size() > kLongSum);
  if constexpr (kShortens) {
    if (!shortens_) return;
    // Each added area has an error of less than 2^-kShortBits of the sum of all squares.
    Number doubt = 0;
    for (const Vector& v : round) doubt += square(v);
    for (const Vector& v : centre) doubt += square(v);
    for (int bits = 0; bits < kShortBits / 2; bits += 32) doubt *= Number(0x1p-32);
    if (total < doubt) measure(cavity, p, false);
  }
}

template <class Number>
void VoronoiCell<Number>::measure(const Cavity& cavity, const Query& p, bool shortens) {
  shortens_ = shortens;
  const auto number = [](double value) { return Number(value); };
  at.resize(cavity.corner.size());
  area.assign(cavity.corner.size(), Number(0));
  centre.resize(cavity.triangle.size());
  round.resize(cavity.rim.size());
  total = 0;
  error = 0;
  extent = 0;
  for (std::size_t i = 0; i < at.size(); ++i) {
    const Query& v = cavity.corner[i].at;
    at[i] = {number(v[0]) - number(p[0]), number(v[1]) - number(p[1])};
  }
  for (std::size_t i = 0; i < centre.size(); ++i) {
    // Uses differences of the vertices themselves, because those of needles must be accurate.
    const auto [ia, ib, ic] = cavity.triangle[i];
    const Query& a = cavity.corner[ia].at;
    const Query& b = cavity.corner[ib].at;
    const Query& c = cavity.corner[ic].at;
    const Number ax = number(a[0]);
    const Number ay = number(a[1]);
    const Vector u = circumcentre({number(b[0]) - ax, number(b[1]) - ay},
                                  {number(c[0]) - ax, number(c[1]) - ay});
    centre[i] = {at[ia].x + u.x, at[ia].y + u.y};
    if (shortens) centre[i] = shorten(centre[i]);
  }
  for (std::size_t i = 0; i < round.size(); ++i) {
    round[i] = circumcentre(at[cavity.rim[i].from], at[cavity.rim[i].to]);
    if (shortens) round[i] = shorten(round[i]);
    if constexpr (std::is_same_v<Number, double>) extent += square(round[i]);
  }
  const Vector* before = &round.back();
  for (std::size_t i = 0; i < round.size(); ++i) {
    const auto& [from, to, triangle] = cavity.rim[i];
    const Number side = cross(*before, round[i]);
    total += side;
    area[from] += side;
    before = &round[i];
    if (centre.empty()) continue;
    const Number shared = cross(round[i], centre[triangle]);
    area[from] += shared;
    area[to] -= shared;
  }
  for (const auto& [from, to, left, right] : cavity.link) {
    const Number shared = cross(centre[right], centre[left]);
    area[from] += shared;
    area[to] -= shared;
  }
}

template <class Number>
bool VoronoiCell<Number>::accurate() const {
  // If a centre has an error of e, the border of an area moves by e along a length of at most the
  // cell's extent.
  constexpr double kFactor = kRoundings * 0x1p-53 / kTolerance;
  return total > kMinSquare && total < kGreatestSquare &&
         error * extent * (kFactor * kFactor) < total * total;
}

// When a query moves towards a corner of the cavity, the side of its cell facing that corner moves
// too. B. Piper, "Properties of local coordinates based on Dirichlet tesselations",
// doi:10.1007/978-3-7091-6916-2_15: area i grows by the side's length divided by the corner's
// distance, times the vector from the query to the side's midpoint.
template <class Number>
bool VoronoiCell<Number>::differentiate(const Cavity& cavity, bool on_vertex,
                                        std::vector<std::array<double, 2>>& slopes) {
  slope_.resize(at.size());
  slopes.resize(at.size());
  Vector sum{Number(0), Number(0)};
  for (std::size_t i = 0; i < round.size(); ++i) {
    const std::uint32_t corner = cavity.rim[i].from;
    const Vector& v = at[corner];
    const Vector& a = round[i == 0 ? round.size() - 1 : i - 1];
    const Vector& b = round[i];
    const Number ratio = ((b.y - a.y) * v.x - (b.x - a.x) * v.y) / (square(v) * total);
    slope_[corner] = {ratio * (a.x + b.x), ratio * (a.y + b.y)};
    if (shortens_) slope_[corner] = shorten(slope_[corner]);
    sum.x += slope_[corner].x;
    sum.y += slope_[corner].y;
  }
  double size = 0;
  double farthest = 0;
  for (std::size_t i = 0; i < slope_.size(); ++i) {
    Vector& slope = slope_[i];
    if constexpr (std::is_same_v<Number, double>) {
      size += std::abs(slope.x) + std::abs(slope.y);
      farthest = std::max(farthest, square(at[i]));
    }
    if (!on_vertex) {
      const Number weight = area[i] / total;
      slope.x -= weight * sum.x;
      slope.y -= weight * sum.y;
    }
    slopes[i] = {Rounded<Number>::of(slope.x), Rounded<Number>::of(slope.y)};
    if (std::isnan(slopes[i][0]) || std::isnan(slopes[i][1])) return false;
  }
  // The sum of slopes times corners is the identity, so errors are relative to 1.
  return !std::is_same_v<Number, double> ||
         size * std::sqrt(farthest) * (kRoundings * 0x1p-53 / kTolerance) < 1;
}

}  // namespace terrace::tri::planar
