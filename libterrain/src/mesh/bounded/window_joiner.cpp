// SPDX-License-Identifier: Apache-2.0
#include "mesh/bounded/window_joiner.hpp"

#include <limits>
#include <span>
#include <utility>

namespace terrace::terrain {
namespace {

constexpr std::uint32_t kNoVertex = std::numeric_limits<std::uint32_t>::max();

}  // namespace

WindowJoiner::WindowJoiner(const LatticePlan& plan, MeshSpool& spool)
    : plan_(plan),
      spool_(spool),
      above_(static_cast<std::size_t>(plan.whole().columns), kNoVertex),
      below_(above_) {}

std::uint32_t* WindowJoiner::shared(const WindowTin& tin, const tri::GridVertex& vertex) {
  // A corner belongs to two sides; the line above or below knows it whatever its window, the sides
  // to the left and right only if it lies between.
  const std::int64_t column = tin.window.column - plan_.whole().column + vertex.column;
  if (vertex.row == 0) return &above_[static_cast<std::size_t>(column)];
  if (vertex.row + 1 == tin.window.rows) return &below_[static_cast<std::size_t>(column)];
  if (vertex.column == 0) return &left_[vertex.row];
  if (vertex.column + 1 == tin.window.columns) return &right_[vertex.row];
  return nullptr;
}

void WindowJoiner::count_uncovered(const WindowTin& tin) {
  const LatticeWindow &window = tin.window, &whole = plan_.whole();
  for (const std::uint32_t at : tin.uncovered) {
    const std::int64_t column = at % window.columns, row = at / window.columns;
    const auto between = [](std::int64_t place, std::int64_t first, std::int64_t count,
                            std::int64_t whole_first, std::int64_t whole_count) {
      return (place == 0 && first > whole_first) ||
             (place + 1 == count && first + count < whole_first + whole_count);
    };
    const unsigned windows =
        (between(column, window.column, window.columns, whole.column, whole.columns) ? 2U : 1U) *
        (between(row, window.row, window.rows, whole.row, whole.rows) ? 2U : 1U);
    if (windows == 1) {
      ++uncovered_;
      continue;
    }
    const auto known = on_sides_.try_emplace({window.row + row, window.column + column}, 0U).first;
    if (++known->second < windows) continue;
    ++uncovered_;
    on_sides_.erase(known);
  }
}

void WindowJoiner::add(std::size_t i, WindowTin&& tin) {
  count_uncovered(tin);
  const auto rows = static_cast<std::size_t>(tin.window.rows);
  if (i % plan_.across() == 0) {
    if (i > 0) above_ = std::exchange(below_, std::vector<std::uint32_t>(below_.size(), kNoVertex));
    left_.assign(rows, kNoVertex);
  } else {
    left_ = std::move(right_);
  }
  right_.assign(rows, kNoVertex);

  // Vertices that are there already make room for those behind them.
  std::vector<std::uint32_t> numbers;
  numbers.reserve(tin.vertices.size());
  const auto first = static_cast<std::uint32_t>(spool_.vertices());
  std::uint32_t fresh = 0;
  for (std::size_t k = 0; k < tin.vertices.size(); ++k) {
    std::uint32_t* const at_side = shared(tin, tin.vertices[k]);
    if (at_side != nullptr && *at_side != kNoVertex) {
      numbers.push_back(*at_side);
      continue;
    }
    numbers.push_back(first + fresh);
    tin.positions[fresh++] = tin.positions[k];
    if (at_side != nullptr) *at_side = numbers.back();
  }
  for (auto& triangle : tin.triangles) {
    for (std::uint32_t& vertex : triangle) vertex = numbers[vertex];
  }
  spool_.add_vertices(std::span(tin.positions).first(fresh));
  spool_.add_triangles(tin.triangles);
}

}  // namespace terrace::terrain
