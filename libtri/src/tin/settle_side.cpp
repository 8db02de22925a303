// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "options.hpp"
#include "terrace/tri/grid_tin.hpp"

namespace terrace::tri {
namespace {

/// Marks the samples of a line that must be vertices: the ends, the samples on both sides of where
/// data begins or ends, and samples with data that have a neighbour without data on the line or
/// next to it. All samples inside a longer segment with data are therefore surrounded by data, and
/// triangles on the segment can have data too.
template <class T>
std::vector<std::uint8_t> required_vertices(std::span<const T> line,
                                            std::span<const T> neighbour_line,
                                            std::span<const T> other_neighbour_line) {
  const std::size_t count = line.size();
  std::vector<std::uint8_t> required(count, 0);
  required.front() = required.back() = 1;
  const auto has_height = [&](std::size_t i) { return std::isfinite(line[i]); };
  const auto near_gap = [&](std::size_t i) {
    for (std::size_t k = i == 0 ? 0 : i - 1; k < count && k <= i + 1; ++k)
      if (!has_height(k) || (!neighbour_line.empty() && !std::isfinite(neighbour_line[k])) ||
          (!other_neighbour_line.empty() && !std::isfinite(other_neighbour_line[k])))
        return true;
    return false;
  };
  for (std::size_t i = 0; i < count; ++i) {
    const bool next_has_height = i + 1 < count && has_height(i + 1);
    if (i + 1 < count && has_height(i) != next_has_height) required[i] = required[i + 1] = 1;
    if (has_height(i) && near_gap(i)) required[i] = 1;
  }
  return required;
}

/// Splits between a and b until the bound holds.
template <class T>
void simplify(std::span<const T> line, std::size_t a, std::size_t b, double limit,
              std::vector<std::uint8_t>& is_vertex) {
  std::vector<std::pair<std::size_t, std::size_t>> pending{{a, b}};
  while (!pending.empty()) {
    const auto [from, to] = pending.back();
    pending.pop_back();
    const auto start = static_cast<double>(line[from]);
    const double rise = static_cast<double>(line[to]) - start;
    const auto length = static_cast<double>(to - from);
    double largest = std::max(limit, 0x1p-50 * std::fabs(rise));  // ignores rounding errors
    std::size_t worst = from;
    for (std::size_t i = from + 1; i < to; ++i) {
      const double error = std::fabs(static_cast<double>(line[i]) - start -
                                     rise * static_cast<double>(i - from) / length);
      if (error <= largest) continue;
      largest = error;
      worst = i;
    }
    if (worst == from) continue;
    is_vertex[worst] = 1;
    pending.push_back({from, worst});
    pending.push_back({worst, to});
  }
}

}  // namespace

template <class T>
std::vector<std::uint32_t> settle_side(std::span<const T> line, std::span<const T> neighbour_line,
                                       std::span<const T> other_neighbour_line, double max_error) {
  for (const std::span<const T> other : {neighbour_line, other_neighbour_line})
    if (!other.empty() && other.size() != line.size())
      throw std::invalid_argument("settle_side: the lines must have equal lengths");
  if (!(max_error >= 0)) throw std::invalid_argument("settle_side: max_error must not be negative");
  for (const T z : line)
    if (std::isfinite(z) && std::fabs(static_cast<double>(z)) > 1e150)
      throw std::invalid_argument("settle_side: a height is beyond 1e150");
  std::vector<std::uint32_t> vertices;
  if (line.empty()) return vertices;
  std::vector<std::uint8_t> is_vertex =
      required_vertices(line, neighbour_line, other_neighbour_line);
  // Slightly below the bound, so that later rounding cannot exceed it.
  const double limit = max_error * (1 - 1e-5);
  for (std::size_t a = 0, b = 1; b < line.size(); ++b) {
    if (is_vertex[b] == 0) continue;
    if (std::isfinite(line[a]) && std::isfinite(line[b])) simplify(line, a, b, limit, is_vertex);
    a = b;
  }
  for (std::size_t i = 0; i < line.size(); ++i)
    if (is_vertex[i] != 0) vertices.push_back(static_cast<std::uint32_t>(i));
  return vertices;
}

template <class T>
GridSides settle_sides(const GridWindow<T>& window, double max_error) {
  tin::check_shape(window, "settle_sides");
  const std::size_t columns = window.columns, rows = window.rows;
  const auto row = [&](std::size_t y) {
    return y < rows ? window.heights.subspan(y * columns, columns) : std::span<const T>();
  };
  const auto column = [&](std::size_t x) {
    std::vector<T> result;
    if (x < columns)
      for (std::size_t y = 0; y < rows; ++y) result.push_back(window.heights[y * columns + x]);
    return result;
  };
  const auto settle = [&](std::span<const T> line, std::span<const T> neighbour_line) {
    return settle_side<T>(line, neighbour_line, {}, max_error);
  };
  return {settle(row(0), row(1)), settle(row(rows - 1), row(rows - 2)),
          settle(column(0), column(1)), settle(column(columns - 1), column(columns - 2))};
}

template std::vector<std::uint32_t> settle_side(std::span<const float>, std::span<const float>,
                                                std::span<const float>, double);
template std::vector<std::uint32_t> settle_side(std::span<const double>, std::span<const double>,
                                                std::span<const double>, double);
template GridSides settle_sides(const GridWindow<float>&, double);
template GridSides settle_sides(const GridWindow<double>&, double);

}  // namespace terrace::tri
