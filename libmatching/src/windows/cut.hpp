// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include <terrace/base/stop_check.hpp>

namespace terrace::matching::windows {

/// A point, or a pair at its midpoint. Windows never divide it.
template <std::size_t D>
struct Unit {
  std::array<double, D> centre;
  std::uint32_t name;
};

/// Reorders units so that consecutive ranges are compact windows of at most `most` units. Appends
/// the end of each range, counted from `first`, to `ends`.
///
/// Each range is split across the longest side of its bounding box, at a fraction between 3/8 and
/// 5/8 that depends on the seed. Different seeds thus give windows with different borders. With
/// `even`, every part except the last has an even number of units.
/// Cost: O(n log(n / most)).
template <std::size_t D>
void cut(std::span<Unit<D>> units, std::size_t most, bool even, std::uint64_t seed,
         std::size_t first, std::vector<std::size_t>& ends, const base::StopCheck& check_stop) {
  base::StopTicks ticks(check_stop);
  std::vector<std::pair<std::size_t, std::size_t>> open{{0, units.size()}};
  while (!open.empty()) {
    const auto [begin, end] = open.back();
    open.pop_back();
    ticks(8 * (end - begin));
    if (end - begin <= most) {
      if (end != begin) ends.push_back(first + end);
      continue;
    }
    std::size_t axis = 0;
    double widest = -1.0;
    for (std::size_t d = 0; d < D; ++d) {
      double lo = units[begin].centre[d], hi = lo;
      for (std::size_t k = begin; k < end; ++k) {
        lo = std::min(lo, units[k].centre[d]);
        hi = std::max(hi, units[k].centre[d]);
      }
      if (hi - lo > widest) {
        widest = hi - lo;
        axis = d;
      }
    }
    std::uint64_t z = seed * 0x9e3779b97f4a7c15u + begin * 0xbf58476d1ce4e5b9u + end;
    z = (z ^ (z >> 31)) * 0x94d049bb133111ebu;
    const double share = 0.375 + 0.25 * static_cast<double>(z >> 11) * 0x1p-53;
    auto part = static_cast<std::size_t>(share * static_cast<double>(end - begin));
    part = std::clamp<std::size_t>(even ? part & ~std::size_t{1} : part, 1 + (even ? 1u : 0u),
                                   end - begin - 1);
    std::nth_element(units.begin() + static_cast<std::ptrdiff_t>(begin),
                     units.begin() + static_cast<std::ptrdiff_t>(begin + part),
                     units.begin() + static_cast<std::ptrdiff_t>(end),
                     [axis](const Unit<D>& a, const Unit<D>& b) {
                       return std::tie(a.centre[axis], a.name) < std::tie(b.centre[axis], b.name);
                     });
    // The left part is processed first, so it is pushed last.
    open.emplace_back(begin + part, end);
    open.emplace_back(begin, begin + part);
  }
}

}  // namespace terrace::matching::windows
