// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "samples.hpp"

namespace terrace::tri::tin {

template <class T>
GridGaps::GridGaps(const GridSamples<T>& samples, std::int32_t columns, std::int32_t rows)
    : columns_(columns) {
  const auto width = static_cast<std::size_t>(columns), height = static_cast<std::size_t>(rows);
  flags_.resize(width * height);
  for (std::size_t y = 0; y < height; ++y)
    for (std::size_t x = 0; x < width; ++x)
      if (std::isnan(samples.heights[y * samples.stride + x])) flags_[y * width + x] = kMissing;
  inner_counts_.resize((width + 1) * height);
  for (std::int32_t y = 0; y < rows; ++y) {
    std::uint16_t inner_count = 0;
    for (std::int32_t x = 0; x < columns; ++x) {
      bool any_data = false, any_missing = false;
      for (std::int32_t v = std::max(y - 1, 0); v <= std::min(y + 1, rows - 1); ++v)
        for (std::int32_t u = std::max(x - 1, 0); u <= std::min(x + 1, columns - 1); ++u)
          ((flags_[index(u, v)] & kMissing) != 0 ? any_missing : any_data) = true;
      std::uint8_t& flags = flags_[index(x, y)];
      if ((flags & kMissing) != 0) {
        if (any_data) flags |= kCoastal;
      } else if (!any_missing) {
        flags |= kInner;
        ++inner_count;
      }
      inner_counts_[static_cast<std::size_t>(y) * (width + 1) + static_cast<std::size_t>(x) + 1] =
          inner_count;
    }
  }
}

template <class T>
bool GridGaps::mixed(const GridCorner<T>& a, const GridCorner<T>& b, const GridCorner<T>& c) const {
  for (const GridCorner<T>* corner : {&a, &b, &c})
    if ((flags_[index(corner->x, corner->y)] & kInner) != 0) return true;
  return !visit_rows(a, b, c, [&](std::int32_t y, std::int32_t first, std::int32_t last) {
    const std::uint16_t* const row =
        inner_counts_.data() +
        static_cast<std::size_t>(y) * (static_cast<std::size_t>(columns_) + 1);
    return row[first] == row[last + 1];
  });
}

template <class T>
std::uint32_t GridGaps::sample_to_insert(const GridSamples<T>& samples, const Ground& ground,
                                         const GridCorner<T>& a, const GridCorner<T>& b,
                                         const GridCorner<T>& c) const {
  const GridCorner<T>* const corners[3] = {&a, &b, &c};
  const bool all_have_data = !std::isnan(a.z) && !std::isnan(b.z) && !std::isnan(c.z);
  int best_rank = 0;
  std::int64_t best_depth = -1;
  std::uint32_t best = kNone;
  visit_rows(a, b, c, [&](std::int32_t y, std::int32_t first, std::int32_t last) {
    if (y < samples.first_y || y > samples.last_y) return true;
    first = std::max(first, samples.first_x);
    last = std::min(last, samples.last_x);
    for (std::int32_t x = first; x <= last; ++x) {
      const std::uint8_t flags = flags_[index(x, y)];
      if ((flags & kVertex) != 0) continue;
      // If all corners have data, chooses among samples without data, preferably next to data.
      // Otherwise chooses among samples with data, preferably on the shore.
      const bool missing = (flags & kMissing) != 0;
      const int rank = all_have_data           ? (flags & kCoastal) != 0 ? 2
                                                 : missing               ? 1
                                                                         : 0
                       : missing               ? 0
                       : (flags & kInner) == 0 ? 2
                                               : 1;
      if (rank == 0 || rank < best_rank) continue;
      const GridCorner<T> p{x, y, T{}};
      const std::int64_t depth = std::min({turn(a, b, p), turn(b, c, p), turn(c, a, p)});
      if (rank == best_rank && depth <= best_depth) continue;
      best_rank = rank;
      best_depth = depth;
      best = place_at(x, y);
    }
    return true;
  });
  return best != kNone || all_have_data ? best : neighbour_of_inner(samples, ground, corners);
}

/// For a triangle whose only samples are its corners and samples on a side of the window: returns a
/// neighbour of an inner one of these, as close as possible to a corner without data.
template <class T>
std::uint32_t GridGaps::neighbour_of_inner(const GridSamples<T>& samples, const Ground& ground,
                                           const GridCorner<T>* const (&corners)[3]) const {
  std::uint32_t best = kNone;
  std::int64_t best_square = 0;
  const auto compare = [&](std::int32_t x, std::int32_t y) {
    if ((flags_[index(x, y)] & kVertex) != 0) return;
    for (const GridCorner<T>* outer : corners) {
      if ((flags_[index(outer->x, outer->y)] & kMissing) == 0) continue;
      const std::int64_t square = ground.square(GridCorner<T>{x, y, T{}}, *outer);
      if (best != kNone && square >= best_square) continue;
      best_square = square;
      best = place_at(x, y);
    }
  };
  visit_rows(*corners[0], *corners[1], *corners[2],
             [&](std::int32_t y, std::int32_t first, std::int32_t last) {
               for (std::int32_t x = first; x <= last; ++x) {
                 if ((flags_[index(x, y)] & kInner) == 0) continue;
                 for (std::int32_t v = std::max(y - 1, samples.first_y);
                      v <= std::min(y + 1, samples.last_y); ++v)
                   for (std::int32_t u = std::max(x - 1, samples.first_x);
                        u <= std::min(x + 1, samples.last_x); ++u)
                     compare(u, v);
               }
               return true;
             });
  return best;
}

template GridGaps::GridGaps(const GridSamples<float>&, std::int32_t, std::int32_t);
template GridGaps::GridGaps(const GridSamples<double>&, std::int32_t, std::int32_t);
template bool GridGaps::mixed(const GridCorner<float>&, const GridCorner<float>&,
                              const GridCorner<float>&) const;
template bool GridGaps::mixed(const GridCorner<double>&, const GridCorner<double>&,
                              const GridCorner<double>&) const;
template std::uint32_t GridGaps::sample_to_insert(const GridSamples<float>&, const Ground&,
                                                  const GridCorner<float>&,
                                                  const GridCorner<float>&,
                                                  const GridCorner<float>&) const;
template std::uint32_t GridGaps::sample_to_insert(const GridSamples<double>&, const Ground&,
                                                  const GridCorner<double>&,
                                                  const GridCorner<double>&,
                                                  const GridCorner<double>&) const;

}  // namespace terrace::tri::tin
