// SPDX-License-Identifier: Apache-2.0
#include "windows/discs.hpp"

#include <algorithm>
#include <cmath>

#include <terrace/base/parallel.hpp>
#include <terrace/base/stop_check.hpp>

#include "blossom/kd_tree.hpp"

namespace terrace::matching::windows {

using blossom::KdTree;

void Discs::start(std::size_t windows) {
  windows_.assign(windows, {});
  window_.assign(radius_.size(), kNone);
}

void Discs::store(std::size_t w, std::span<const std::uint32_t> points,
                  const PointMatching& matching) {
  const Matching& proof = matching.proof;
  const std::size_t blossoms = proof.blossom_dual.size();
  const double unit = std::ldexp(1.0, -1 - proof.exponent);
  // If a point is left over, the blossoms around the dummy vertex contain an even number of
  // points and cannot be used on their own.
  std::vector<bool> dropped(blossoms, false);
  if (proof.mate.size() > points.size()) {
    for (std::uint32_t b = proof.vertex_blossom.back(); b != kNone; b = proof.blossom_parent[b]) {
      dropped[b] = true;
    }
  }
  Window& window = windows_[w];
  // Blossoms are renumbered in the order in which the walks outward from the points reach them, the
  // outermost of each path first. Nests may be deep, so each blossom is visited only once.
  std::vector<std::uint32_t> number(blossoms, kNone), chain;
  std::vector<double>
      total_width;  // of each moat: its width plus the widths of all moats around it
  for (std::size_t k = 0; k < points.size(); ++k) {
    std::uint32_t b = proof.vertex_blossom[k];
    for (; b != kNone && !dropped[b] && number[b] == kNone; b = proof.blossom_parent[b]) {
      chain.push_back(b);
    }
    std::uint32_t moat = b == kNone || dropped[b] ? kNone : number[b];
    for (; !chain.empty(); chain.pop_back()) {
      const double width = unit * static_cast<double>(proof.blossom_dual[chain.back()]);
      window.sum += width;
      total_width.push_back(moat == kNone ? width : total_width[moat] + width);
      window.moats.push_back({width, moat});
      moat = number[chain.back()] = static_cast<std::uint32_t>(window.moats.size() - 1);
    }
    const double disc = unit * static_cast<double>(proof.vertex_dual[k]);
    window.sum += disc;
    radius_[points[k]] = moat == kNone ? disc : disc + total_width[moat];
    moat_[points[k]] = moat;
    window_[points[k]] = static_cast<std::uint32_t>(w);
  }
}

// A moat shrinks for all points inside it at once, outer moats first. The discs shrink by the rest.
void Discs::shrink(const std::vector<double>& excess) {
  // For each moat: first the reduction that its points need, then the sum of the reductions of the
  // moat and the moats around it.
  std::vector<std::vector<double>> reduction(windows_.size());
  for (std::size_t w = 0; w < windows_.size(); ++w)
    reduction[w].assign(windows_[w].moats.size(), 0.0);
  for (std::size_t i = 0; i < radius_.size(); ++i) {
    if (moat_[i] == kNone) continue;
    double& need = reduction[window_[i]][moat_[i]];
    need = std::max(need, excess[i]);
  }
  for (std::size_t w = 0; w < windows_.size(); ++w) {
    std::vector<Moat>& moats = windows_[w].moats;
    for (std::size_t m = moats.size(); m-- > 0;) {
      if (moats[m].parent == kNone) continue;
      double& need = reduction[w][moats[m].parent];
      need = std::max(need, reduction[w][m]);
    }
    for (std::size_t m = 0; m < moats.size(); ++m) {
      const double outward = moats[m].parent == kNone ? 0.0 : reduction[w][moats[m].parent];
      const double shrinkage = std::clamp(reduction[w][m] - outward, 0.0, moats[m].width);
      moats[m].width -= shrinkage;
      windows_[w].sum -= shrinkage;
      reduction[w][m] = outward + shrinkage;
    }
  }
  for (std::size_t i = 0; i < radius_.size(); ++i) {
    const double moats = moat_[i] == kNone ? 0.0 : reduction[window_[i]][moat_[i]];
    const double disc = std::max(0.0, excess[i] - moats);
    windows_[window_[i]].sum -= disc;
    radius_[i] -= moats + disc;
  }
}

namespace {

/// Computes by how much each point's radius is too large for the points of other windows.
template <std::size_t D>
class Excess {
 public:
  using Point = std::array<double, D>;

  Excess(std::span<const Point> points, const PointMetric& metric,
         std::span<const std::uint32_t> window, unsigned threads, const base::StopCheck& check_stop)
      : points_(points),
        metric_(metric),
        window_(window),
        threads_(threads),
        check_stop_(check_stop),
        order_(blossom::halving_order(points, base::StopTicks(check_stop))),
        tree_(sorted(points, order_)),
        common_window_(tree_.nodes().size()),
        max_other_(tree_.nodes().size()) {
    for (std::size_t x = common_window_.size(); x-- > 0;) {
      const auto& node = tree_.nodes()[x];
      if (node.right != 0) {
        common_window_[x] =
            common_window_[x + 1] == common_window_[node.right] ? common_window_[x + 1] : kNone;
        continue;
      }
      common_window_[x] = window_[order_[node.begin]];
      for (std::uint32_t k = node.begin; k < node.end; ++k) {
        if (window_[order_[k]] != common_window_[x]) common_window_[x] = kNone;
      }
    }
  }

  /// Returns each point's distance to its nearest neighbour, capped at `limit`.
  std::vector<double> nearest(std::span<const double> limit) const {
    std::vector<double> result(points_.size(), 0.0);
    for_each_chunk([&](std::uint32_t k, std::vector<std::uint32_t>&) {
      std::vector<std::pair<double, std::uint32_t>> found;
      tree_.nearest(k, 1, found);
      const std::uint32_t i = order_[k];
      const double spacing = found.empty() ? limit[i] : distance(i, order_[found[0].second]);
      result[i] = std::min(spacing, limit[i]);
    });
    return result;
  }

  /// Returns, for each point i, the largest share * (radii[i] + other_radii[j] - distance) over the
  /// points j of other windows, or 0 if that is negative.
  std::vector<double> operator()(std::span<const double> radii, std::span<const double> other_radii,
                                 double share) {
    const auto& nodes = tree_.nodes();
    for (std::size_t x = nodes.size(); x-- > 0;) {
      const auto& node = nodes[x];
      if (node.right != 0) {
        max_other_[x] = std::max(max_other_[x + 1], max_other_[node.right]);
        continue;
      }
      max_other_[x] = other_radii[order_[node.begin]];
      for (std::uint32_t k = node.begin; k < node.end; ++k) {
        max_other_[x] = std::max(max_other_[x], other_radii[order_[k]]);
      }
    }
    std::vector<double> result(points_.size(), 0.0);
    for_each_chunk([&](std::uint32_t k, std::vector<std::uint32_t>& open) {
      const std::uint32_t i = order_[k];
      double excess = 0.0;
      open.assign(1, 0);
      while (!open.empty()) {
        const std::uint32_t x = open.back();
        open.pop_back();
        if (common_window_[x] == window_[i]) continue;
        const auto& node = nodes[x];
        const double euclidean = std::sqrt(node.box.squared_distance(points_[i])) * (1.0 - 1e-13);
        const double least =
            metric_.distance ? metric_.factor * euclidean - metric_.offset : euclidean;
        if (radii[i] + max_other_[x] - least <= excess) continue;
        if (node.right != 0) {
          open.push_back(node.right);
          open.push_back(x + 1);
          continue;
        }
        for (std::uint32_t at = node.begin; at < node.end; ++at) {
          const std::uint32_t j = order_[at];
          if (window_[j] != window_[i])
            excess = std::max(excess, radii[i] + other_radii[j] - distance(i, j));
        }
      }
      result[i] = share * excess;
    });
    return result;
  }

 private:
  static std::vector<Point> sorted(std::span<const Point> points,
                                   const std::vector<std::uint32_t>& order) {
    std::vector<Point> result(points.size());
    for (std::size_t k = 0; k < order.size(); ++k) result[k] = points[order[k]];
    return result;
  }

  double distance(std::uint32_t i, std::uint32_t j) const {
    return metric_.distance ? metric_.distance(i, j)
                            : std::sqrt(KdTree<D>::distance2(points_[i], points_[j]));
  }

  template <class Work>
  void for_each_chunk(const Work& work) const {
    constexpr std::size_t kChunk = 4096, kTicksOfSearch = 1024;
    const std::size_t n = points_.size();
    base::parallel_for((n + kChunk - 1) / kChunk, threads_, [&](std::size_t chunk) {
      std::vector<std::uint32_t> open;
      base::StopTicks ticks(check_stop_);
      for (std::size_t k = chunk * kChunk; k < std::min(n, (chunk + 1) * kChunk); ++k) {
        ticks(kTicksOfSearch);
        work(static_cast<std::uint32_t>(k), open);
      }
    });
  }

  std::span<const Point> points_;
  const PointMetric& metric_;
  std::span<const std::uint32_t> window_;
  unsigned threads_;
  const base::StopCheck& check_stop_;
  std::vector<std::uint32_t> order_;
  KdTree<D> tree_;
  std::vector<std::uint32_t> common_window_;  // of each box: the window of all its points, or kNone
  std::vector<double> max_other_;             // of each box: the largest of `other_radii` in it
};

}  // namespace

template <std::size_t D>
double Discs::bound(std::span<const std::array<double, D>> points, const PointMetric& metric,
                    unsigned threads, const base::StopCheck& check_stop) {
  Excess<D> excess(points, metric, window_, threads, check_stop);
  // First shrink the radii that reach far beyond their window, as if all other radii were at most
  // the distance to the nearest neighbour. Otherwise one wide moat would shrink a thousand small
  // discs. Then shrink both points of each remaining pair, by half each.
  shrink(excess(radius_, excess.nearest(radius_), 1.0));
  shrink(excess(radius_, radius_, 0.5));
  double sum = 0.0;
  for (const Window& window : windows_) sum += window.sum;
  if (radius_.size() % 2 == 0) return sum;
  // The dummy vertex is at distance 0 from all points, so leaving a point over costs its radius.
  return sum - *std::max_element(radius_.begin(), radius_.end());
}

template double Discs::bound(std::span<const Point2>, const PointMetric&, unsigned,
                             const base::StopCheck&);
template double Discs::bound(std::span<const Point3>, const PointMetric&, unsigned,
                             const base::StopCheck&);

}  // namespace terrace::matching::windows
