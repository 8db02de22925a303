// SPDX-License-Identifier: Apache-2.0
#include "surface/store_window.hpp"

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <limits>

namespace terrace::terrain {
namespace {

constexpr std::size_t kMaxExamples = 12;

/// Visits the clusters with points of `level` and above in the box.
template <class Visit>
void descend(stream::StoreQuery& query, const StoredBox& box, unsigned level, const Visit& visit) {
  query.descend(
      level,
      [&box](unsigned, const stream::StoreQuery::Branch& branch) {
        return box.intersects(flat(branch.box));
      },
      visit);
}

}  // namespace

std::optional<ClusterHeights> cluster_heights(stream::StoreQuery& query, const StoredBox& box) {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  ClusterHeights heights{.low = kFar, .high = -kFar, .examples = {}};
  query.cut(
      tall(box),
      [&](const stream::Point3* head, const stream::StoreQuery::Branch& cluster) {
        heights.low = std::min(heights.low, cluster.box.min[2]);
        heights.high = std::max(heights.high, cluster.box.max[2]);
        if (head != nullptr && heights.examples.size() < kMaxExamples &&
            box.contains(flat(*head))) {
          heights.examples.push_back(*head);
        }
        return true;
      },
      [&](const stream::StoreQuery::Branch& cluster) {
        // The clusters below cannot widen the range.
        const bool has_range =
            heights.low <= cluster.box.min[2] && heights.high >= cluster.box.max[2];
        return !(has_range && heights.examples.size() == kMaxExamples);
      });
  if (heights.low > heights.high) return std::nullopt;
  return heights;
}

StoreWindow::StoreWindow(const stream::Store& store, std::uint64_t cache_bytes)
    : query_(store, cache_bytes) {}

template <class Height>
void StoreWindow::scatter(const LatticeWindow& window, std::span<Height> out, unsigned level) {
  const stream::StoreSchema& schema = query_.store().schema();
  assert(schema.grid);
  assert(out.size() == window.size());
  std::fill(out.begin(), out.end(), std::numeric_limits<Height>::quiet_NaN());
  if (window.columns <= 0 || window.rows <= 0) return;
  const stream::Channel& channel = schema.coordinates[2];
  const auto columns = static_cast<std::size_t>(window.columns);
  const StoredBox box{{static_cast<double>(window.column), static_cast<double>(window.row)},
                      {static_cast<double>(window.column + window.columns - 1),
                       static_cast<double>(window.row + window.rows - 1)}};
  const double scale = channel.scale, offset = channel.offset;
  descend(query_, box, level, [&](const stream::StoreQuery::Node& node) {
    for (const stream::Point3& p : node.positions) {
      if (!box.contains(flat(p))) continue;
      const auto column = static_cast<std::size_t>(static_cast<std::int64_t>(p[0] - box.min[0]));
      const auto row = static_cast<std::size_t>(static_cast<std::int64_t>(p[1] - box.min[1]));
      out[row * columns + column] = static_cast<Height>(p[2] * scale + offset);
    }
  });
}

void StoreWindow::heights(const LatticeWindow& window, std::span<double> out, unsigned level) {
  scatter(window, out, level);
}

void StoreWindow::heights(const LatticeWindow& window, std::span<float> out, unsigned level) {
  assert(float_is_exact());
  scatter(window, out, level);
}

bool StoreWindow::float_is_exact() const {
  const stream::Channel& channel = query_.store().schema().coordinates[2];
  if (channel.scale != 1.0 || channel.offset != 0.0) return false;
  switch (channel.type) {
    case stream::ScalarType::i8:
    case stream::ScalarType::u8:
    case stream::ScalarType::i16:
    case stream::ScalarType::u16:
    case stream::ScalarType::f32:
      return true;
    default:
      return false;
  }
}

void StoreWindow::points(const StoredBox& box, WindowPoints& out, unsigned level) {
  out.clear();
  descend(query_, box, level, [&](const stream::StoreQuery::Node& node) {
    for (const stream::Point3& p : node.positions) {
      if (!box.contains(flat(p))) continue;
      out.positions.push_back(p);
      out.levels.push_back(static_cast<std::uint8_t>(node.level()));
    }
  });
}

}  // namespace terrace::terrain
