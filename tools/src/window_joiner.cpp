// SPDX-License-Identifier: GPL-3.0-or-later
#include "window_joiner.hpp"

#include <limits>
#include <utility>

#include "region_overlap.hpp"

namespace terrace::tools {
namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

}  // namespace

WindowJoiner::WindowJoiner(const LatticePlan& plan, const WindowMesher& mesher,
                           const std::optional<Region>& region, MeshSpool& spool)
    : plan_(plan),
      mesher_(mesher),
      region_(region),
      spool_(spool),
      above_(static_cast<std::size_t>(plan.whole().columns), kNone),
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

void WindowJoiner::add(std::size_t i, const WindowTin& tin) {
  const auto rows = static_cast<std::size_t>(tin.window.rows);
  if (i % plan_.across() == 0) {
    if (i > 0) above_ = std::exchange(below_, std::vector<std::uint32_t>(below_.size(), kNone));
    left_.assign(rows, kNone);
  } else {
    left_ = std::move(right_);
  }
  right_.assign(rows, kNone);

  std::vector<std::uint32_t> numbers(tin.vertices.size(), kNone);
  const auto number_of = [&](std::uint32_t vertex) {
    std::uint32_t& number = numbers[vertex];
    if (number != kNone) return number;
    std::uint32_t* const at_side = shared(tin, tin.vertices[vertex]);
    if (at_side != nullptr && *at_side != kNone) return number = *at_side;
    number = static_cast<std::uint32_t>(spool_.vertices());
    spool_.add_vertex(mesher_.position(tin.window, tin.vertices[vertex]));
    if (at_side != nullptr) *at_side = number;
    return number;
  };
  for (const auto& triangle : tin.triangles) {
    if (region_) {
      const auto corner = [&](std::size_t k) {
        return mesher_.position(tin.window, tin.vertices[triangle[k]]);
      };
      if (!touches(*region_, {corner(0), corner(1), corner(2)})) continue;
    }
    spool_.add_triangle({number_of(triangle[0]), number_of(triangle[1]), number_of(triangle[2])});
  }
}

}  // namespace terrace::tools
