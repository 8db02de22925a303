// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "terrace/matching/bounding_volume_hierarchy.hpp"

/// The peers of the matching tree: two common top-down builds. Both go down to single primitives,
/// so that leaves by cost, layout and queries are the same for all trees.

namespace terrace::matching::peers {

using Boxes = std::span<const base::Box3>;

/// Divides until every part is a single primitive. `Split` reorders a range of primitives and
/// returns its middle.
template <class Split>
std::vector<TreeChildren> divide(std::size_t n, Split&& split) {
  std::vector<std::uint32_t> order(n);
  std::iota(order.begin(), order.end(), 0u);
  std::vector<TreeChildren> rows;
  rows.reserve(n);
  struct Open {
    std::uint32_t begin, end, middle;
    bool divided;
  };
  std::vector<Open> open{{0, static_cast<std::uint32_t>(n), 0, false}};
  std::vector<std::uint32_t> created;
  while (n > 0 && !open.empty()) {
    Open at = open.back();
    open.pop_back();
    if (at.end - at.begin == 1) {
      created.push_back(order[at.begin]);
    } else if (at.divided) {
      const std::uint32_t b = created.back();
      created.pop_back();
      rows.push_back({created.back(), b});
      created.back() = static_cast<std::uint32_t>(n + rows.size() - 1);
    } else {
      const auto range = std::span(order).subspan(at.begin, at.end - at.begin);
      at.middle = at.begin + static_cast<std::uint32_t>(split(range));
      at.divided = true;
      open.push_back(at);
      open.push_back({at.middle, at.end, 0, false});
      open.push_back({at.begin, at.middle, 0, false});
    }
  }
  return rows;
}

inline double centre(const base::Box3& box, std::size_t d) {
  return 0.5 * (box.min[d] + box.max[d]);
}

inline base::Box3 box_of_centres(Boxes boxes, std::span<const std::uint32_t> range) {
  base::Box3 all;
  for (const std::uint32_t i : range) {
    all.include(Point3{centre(boxes[i], 0), centre(boxes[i], 1), centre(boxes[i], 2)});
  }
  return all;
}

inline std::size_t halve(Boxes boxes, std::span<std::uint32_t> range) {
  const base::Box3 all = box_of_centres(boxes, range);
  std::size_t axis = 0;
  for (std::size_t d = 1; d < 3; ++d) {
    if (all.max[d] - all.min[d] > all.max[axis] - all.min[axis]) axis = d;
  }
  const std::size_t middle = range.size() / 2;
  std::nth_element(range.begin(), range.begin() + static_cast<std::ptrdiff_t>(middle), range.end(),
                   [&](std::uint32_t i, std::uint32_t j) {
                     return std::tuple(centre(boxes[i], axis), i) <
                            std::tuple(centre(boxes[j], axis), j);
                   });
  return middle;
}

/// Builds a kd-tree that splits at the median along the longest side of the box around the centres.
inline std::vector<TreeChildren> median_split(Boxes boxes) {
  return divide(boxes.size(), [&](std::span<std::uint32_t> range) { return halve(boxes, range); });
}

inline double half_area(const base::Box3& box) {
  const double x = box.max[0] - box.min[0], y = box.max[1] - box.min[1],
               z = box.max[2] - box.min[2];
  return x * y + y * z + z * x;
}

struct Bin {
  base::Box3 box{};
  std::size_t count = 0;

  void add(const base::Box3& other) { box.include(other); }
};

/// Splits where the sum of area times primitives is least over kBins bins along each axis (I. Wald,
/// 2007), or at the median where all centres coincide.
inline std::vector<TreeChildren> binned_sah(Boxes boxes) {
  constexpr std::size_t kBins = 16;
  return divide(boxes.size(), [&](std::span<std::uint32_t> range) {
    const base::Box3 all = box_of_centres(boxes, range);
    const auto bin_of = [&](std::uint32_t i, std::size_t axis) {
      const double share =
          (centre(boxes[i], axis) - all.min[axis]) / (all.max[axis] - all.min[axis]);
      return std::min(kBins - 1, static_cast<std::size_t>(share * static_cast<double>(kBins)));
    };
    double least = std::numeric_limits<double>::infinity();
    std::size_t best_axis = 3, best_bin = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (!(all.max[axis] > all.min[axis])) continue;
      std::array<Bin, kBins> bins;
      for (const std::uint32_t i : range) {
        Bin& bin = bins[bin_of(i, axis)];
        bin.add(boxes[i]);
        ++bin.count;
      }
      std::array<double, kBins> cost{};  // cost of bins k and up
      Bin sum;
      for (std::size_t k = kBins; k-- > 1;) {
        if (bins[k].count > 0) sum.add(bins[k].box);
        sum.count += bins[k].count;
        cost[k] = sum.count > 0 ? half_area(sum.box) * static_cast<double>(sum.count) : 0.0;
      }
      sum = {};
      for (std::size_t k = 0; k + 1 < kBins; ++k) {
        if (bins[k].count > 0) sum.add(bins[k].box);
        sum.count += bins[k].count;
        if (sum.count == 0 || sum.count == range.size()) continue;
        const double split_cost = half_area(sum.box) * static_cast<double>(sum.count) + cost[k + 1];
        if (split_cost < least) {
          least = split_cost;
          best_axis = axis;
          best_bin = k;
        }
      }
    }
    if (best_axis == 3) return halve(boxes, range);
    const auto middle = std::partition(range.begin(), range.end(), [&](std::uint32_t i) {
      return bin_of(i, best_axis) <= best_bin;
    });
    return static_cast<std::size_t>(middle - range.begin());
  });
}

}  // namespace terrace::matching::peers
