// SPDX-License-Identifier: Apache-2.0
#include "base/point_spacing.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>

#include <terrace/base/stop_check.hpp>

#include "base/parallel.hpp"

namespace terrace::terrain {
namespace {

constexpr std::size_t kLeaf = 8;
constexpr unsigned kMaxRank = 32;

/// Halves the points across their longest side until at most kLeaf are left. The halves of [first,
/// last) meet at its middle.
class Tree {
 public:
  Tree(std::span<const stream::Point3> points, const base::StopCheck& check_stop)
      : points_(points), order_(points.size()), ticks_(check_stop) {
    std::iota(order_.begin(), order_.end(), 0U);
    splits_.resize(points.size());
    divide(0, order_.size());
  }

  /// Returns the squared distance to the `rank`-th nearest other point.
  [[nodiscard]] double square(std::uint32_t of, unsigned rank) const {
    Nearest nearest{of, points_[of], rank};
    search(0, order_.size(), nearest);
    return nearest.count == 0 ? 0.0 : nearest.squares[nearest.count - 1];
  }

 private:
  struct Nearest {
    std::uint32_t self;
    stream::Point3 place;
    unsigned rank;
    unsigned count = 0;
    std::array<double, kMaxRank> squares{};  // ascending

    [[nodiscard]] double worst() const {
      return count < rank ? std::numeric_limits<double>::infinity() : squares[count - 1];
    }
    void take(double square) {
      if (!(square < worst())) return;
      if (count < rank) ++count;
      unsigned at = count - 1;
      for (; at > 0 && squares[at - 1] > square; --at) squares[at] = squares[at - 1];
      squares[at] = square;
    }
  };

  struct Split {
    double value;
    std::size_t axis;
  };

  void divide(std::size_t first, std::size_t last) {
    if (last - first <= kLeaf) return;
    stream::Box3 box;
    for (std::size_t i = first; i < last; ++i) {
      ticks_(4);
      box.include(points_[order_[i]]);
    }
    std::size_t axis = 0;
    for (std::size_t k = 1; k < 3; ++k) {
      if (box.max[k] - box.min[k] > box.max[axis] - box.min[axis]) axis = k;
    }
    const std::size_t middle = first + (last - first) / 2;
    const auto at = [this](std::size_t i) {
      return order_.begin() + static_cast<std::ptrdiff_t>(i);
    };
    std::nth_element(at(first), at(middle), at(last), [&](std::uint32_t a, std::uint32_t b) {
      ticks_(4);
      return points_[a][axis] < points_[b][axis];
    });
    splits_[middle] = {points_[order_[middle]][axis], axis};
    divide(first, middle);
    divide(middle, last);
  }

  void search(std::size_t first, std::size_t last, Nearest& nearest) const {
    if (last - first <= kLeaf) {
      for (std::size_t i = first; i < last; ++i) {
        if (order_[i] == nearest.self) continue;
        double square = 0;
        for (std::size_t k = 0; k < 3; ++k) {
          const double d = points_[order_[i]][k] - nearest.place[k];
          square += d * d;
        }
        nearest.take(square);
      }
      return;
    }
    const std::size_t middle = first + (last - first) / 2;
    const double beyond = nearest.place[splits_[middle].axis] - splits_[middle].value;
    // Points on the plane may be in either half.
    if (beyond < 0) {
      search(first, middle, nearest);
      if (beyond * beyond < nearest.worst()) search(middle, last, nearest);
    } else {
      search(middle, last, nearest);
      if (beyond * beyond < nearest.worst()) search(first, middle, nearest);
    }
  }

  std::span<const stream::Point3> points_;
  std::vector<std::uint32_t> order_;
  std::vector<Split> splits_;  // indexed by the middle of a part
  base::StopTicks ticks_;
};

}  // namespace

std::vector<float> neighbour_distances(std::span<const stream::Point3> points, unsigned rank,
                                       unsigned threads, const std::stop_token& stop) {
  assert(rank >= 1 && rank <= kMaxRank);
  const auto check_stop = [&stop] {
    if (stop.stop_requested()) throw stream::Stopped();
  };
  const Tree tree(points, check_stop);
  std::vector<float> distances(points.size());
  parallel_bands(static_cast<std::uint32_t>(points.size()), threads,
                 [&](std::uint32_t first, std::uint32_t last) {
                   base::StopTicks ticks(check_stop);
                   for (std::uint32_t i = first; i < last; ++i) {
                     ticks(256);
                     distances[i] = static_cast<float>(std::sqrt(tree.square(i, rank)));
                   }
                 });
  return distances;
}

}  // namespace terrace::terrain
