// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "block/state.hpp"

namespace terrace::cluster {

/// Stores the points of the mask densely in the pool, starting at `place`. May write up to sixteen
/// lanes.
template <class V>
[[gnu::always_inline]] inline void compress_points(BlockState& s, std::uint32_t place,
                                                   typename V::Mask mask, V x, V y, V z, V w, V d,
                                                   V p) {
  compress(s.px + place, mask, x);
  compress(s.py + place, mask, y);
  compress(s.pz + place, mask, z);
  compress(s.pw + place, mask, w);
  compress(s.pd + place, mask, d);
  compress(s.pp + place, mask, p);
}

/// Rebuilds the segments of all facilities from the last assignment. Sixteen points of the curve
/// belong to few facilities, and the points of each facility are moved with one compression per
/// column.
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
        // Lanes beyond the clients are overwritten by later ones or are after the end of the
        // segment.
        const std::uint32_t place = s_.closes[j];
        compress_points(s_, place, mask, x, y, z, w, d, p);
        s_.closes[j] = place + clients;
      });
    }
    for (std::uint32_t j = 0; j < s_.facility_count; ++j) fill_surplus(j);
  }

 private:
  using Mask = typename V::Mask;

  /// Calls visit(number, clients, count of clients) for each facility that serves one of sixteen
  /// points.
  template <class Visit>
  [[gnu::always_inline]] void each_facility(std::uint32_t first, Visit visit) {
    const V numbers = V::load_integers(s_.nearest + first);
    // Surplus lanes have the facility of the last point. They come last and are not counted.
    const std::uint32_t points = s_.count - first;
    std::uint32_t left = points < kLanes ? (1u << points) - 1 : (1u << kLanes) - 1;
    while (left != 0) {
      const std::uint32_t j = s_.nearest[first + static_cast<std::uint32_t>(__builtin_ctz(left))];
      const Mask mask = equal(numbers, V::broadcast(static_cast<float>(j)));
      const std::uint32_t clients = mask.bits() & left;
      visit(j, mask, static_cast<std::uint32_t>(__builtin_popcount(clients)));
      left ^= clients;
    }
  }

  /// Sets surplus lanes to the facility's position.
  void fill_surplus(std::uint32_t j) {
    const std::uint32_t end = s_.begin[j] + round_to_lanes(s_.size[j]);
    for (std::uint32_t place = s_.begin[j] + s_.size[j]; place < end; ++place) {
      s_.px[place] = s_.fx[j];
      s_.py[place] = s_.fy[j];
      s_.pz[place] = s_.fz[j];
      s_.pw[place] = s_.pd[place] = 0;
    }
  }

  BlockState& s_;
};

}  // namespace terrace::cluster
