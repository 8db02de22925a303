// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "block/state.hpp"

namespace terrace::cluster {

/// Stores the points of the mask densely in the pool, starting at `slot`. May write sixteen lanes.
template <class V>
[[gnu::always_inline]] inline void compress_points(BlockState& s, std::uint32_t slot,
                                                   typename V::Mask mask, V x, V y, V z, V w, V d,
                                                   V p) {
  compress(s.px + slot, mask, x);
  compress(s.py + slot, mask, y);
  compress(s.pz + slot, mask, z);
  compress(s.pw + slot, mask, w);
  compress(s.pd + slot, mask, d);
  compress(s.pp + slot, mask, p);
}

/// Rebuilds the segments of all facilities from the last assignment. Sixteen consecutive points of
/// the curve belong to few facilities, so one compression per column and facility moves them.
template <class V>
class Segments {
 public:
  explicit Segments(BlockState& state) : s_(state) {}

  /// Builds the segments and drops facilities without clients.
  void build() {
    for (std::uint32_t j = 0; j < s_.facility_count; ++j) s_.size[j] = 0;
    for (std::uint32_t i = 0; i < s_.count; i += kLanes) {
      each_facility(i,
                    [&](std::uint32_t j, Mask, std::uint32_t clients) { s_.size[j] += clients; });
    }
    s_.place_segments();
    for (std::uint32_t i = 0; i < s_.count; i += kLanes) {
      const V x = V::load(s_.x + i);
      const V y = V::load(s_.y + i);
      const V z = V::load(s_.z + i);
      const V w = V::load(s_.w + i);
      const V d = V::load(s_.distance + i);
      const V p = V::iota() + V::broadcast(static_cast<float>(i));
      each_facility(i, [&](std::uint32_t j, Mask mask, std::uint32_t clients) {
        // Later clients overwrite the lanes after these clients, or the lanes are after the end of
        // the segment.
        const std::uint32_t slot = s_.cursor[j];
        compress_points(s_, slot, mask, x, y, z, w, d, p);
        s_.cursor[j] = slot + clients;
      });
    }
    for (std::uint32_t j = 0; j < s_.facility_count; ++j) fill_surplus(j);
  }

 private:
  using Mask = typename V::Mask;

  /// Calls visit(facility, mask of its clients, their number) for each facility that serves one of
  /// sixteen points.
  template <class Visit>
  [[gnu::always_inline]] void each_facility(std::uint32_t first, Visit visit) {
    const V numbers = V::load_integers(s_.nearest + first);
    // Surplus lanes have the facility of the last point. They come last and are not counted.
    const std::uint32_t points = s_.count - first;
    std::uint32_t remaining = points < kLanes ? (1u << points) - 1 : (1u << kLanes) - 1;
    while (remaining != 0) {
      const std::uint32_t j =
          s_.nearest[first + static_cast<std::uint32_t>(__builtin_ctz(remaining))];
      const Mask mask = equal(numbers, V::broadcast(static_cast<float>(j)));
      const std::uint32_t clients = mask.bits() & remaining;
      visit(j, mask, static_cast<std::uint32_t>(__builtin_popcount(clients)));
      remaining ^= clients;
    }
  }

  /// Sets surplus lanes to the facility's position.
  void fill_surplus(std::uint32_t j) {
    const std::uint32_t end = s_.begin[j] + round_to_lanes(s_.size[j]);
    for (std::uint32_t slot = s_.begin[j] + s_.size[j]; slot < end; ++slot) {
      s_.px[slot] = s_.fx[j];
      s_.py[slot] = s_.fy[j];
      s_.pz[slot] = s_.fz[j];
      s_.pw[slot] = s_.pd[slot] = 0;
    }
  }

  BlockState& s_;
};

}  // namespace terrace::cluster
