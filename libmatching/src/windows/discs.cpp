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
  window_.assign(radius_.size(), kNobody);
}

void Discs::take(std::size_t w, std::span<const std::uint32_t> points,
                 const PointMatching& matching) {
  const Matching& proof = matching.proof;
  const std::size_t blossoms = proof.blossom_dual.size();
  const double unit = std::ldexp(1.0, -1 - proof.exponent);
  // If a point is left over, the blossoms around the vertex for nobody contain an even number of
  // points and cannot be used on their own.
  std::vector<bool> dropped(blossoms, false);
  if (proof.mate.size() > points.size()) {
    for (std::uint32_t b = proof.vertex_blossom.back(); b != kNobody; b = proof.blossom_parent[b]) {
      dropped[b] = true;
    }
  }
  Window& window = windows_[w];
  // Blossoms are renumbered in the order in which the walks outward from the points reach them, the
  // outermost of each path first. Nests may be deep, so each blossom is visited only once.
  std::vector<std::uint32_t> number(blossoms, kNobody), chain;
  std::vector<double> around;  // for each moat: its width plus the widths of all moats around it
  for (std::size_t k = 0; k < points.size(); ++k) {
    std::uint32_t b = proof.vertex_blossom[k];
    for (; b != kNobody && !dropped[b] && number[b] == kNobody; b = proof.blossom_parent[b]) {
      chain.push_back(b);
    }
    std::uint32_t moat = b == kNobody || dropped[b] ? kNobody : number[b];
    for (; !chain.empty(); chain.pop_back()) {
      const double width = unit * static_cast<double>(proof.blossom_dual[chain.back()]);
      window.sum += width;
      around.push_back(moat == kNobody ? width : around[moat] + width);
      window.moats.push_back({width, moat});
      moat = number[chain.back()] = static_cast<std::uint32_t>(window.moats.size() - 1);
    }
    const double disc = unit * static_cast<double>(proof.vertex_dual[k]);
    window.sum += disc;
    radius_[points[k]] = moat == kNobody ? disc : disc + around[moat];
    moat_[points[k]] = moat;
    window_[points[k]] = static_cast<std::uint32_t>(w);
  }
}

// A moat shrinks for all points inside it at once, outer moats first. The discs shrink by the rest.
void Discs::shrink(const std::vector<double>& excess) {
  // First collects, for each moat, the amount its points need; then the amount given by it and the
  // moats around it.
  std::vector<std::vector<double>> given(windows_.size());
  for (std::size_t w = 0; w < windows_.size(); ++w) given[w].assign(windows_[w].moats.size(), 0.0);
  for (std::size_t i = 0; i < radius_.size(); ++i) {
    if (moat_[i] == kNobody) continue;
    double& need = given[window_[i]][moat_[i]];
    need = std::max(need, excess[i]);
  }
  for (std::size_t w = 0; w < windows_.size(); ++w) {
    std::vector<Moat>& moats = windows_[w].moats;
    for (std::size_t m = moats.size(); m-- > 0;) {
      if (moats[m].parent == kNobody) continue;
      double& need = given[w][moats[m].parent];
      need = std::max(need, given[w][m]);
    }
    for (std::size_t m = 0; m < moats.size(); ++m) {
      const double outward = moats[m].parent == kNobody ? 0.0 : given[w][moats[m].parent];
      const double gives = std::clamp(given[w][m] - outward, 0.0, moats[m].width);
      moats[m].width -= gives;
      windows_[w].sum -= gives;
      given[w][m] = outward + gives;
    }
  }
  for (std::size_t i = 0; i < radius_.size(); ++i) {
    const double moats = moat_[i] == kNobody ? 0.0 : given[window_[i]][moat_[i]];
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
        owner_(tree_.nodes().size()),
        largest_(tree_.nodes().size()) {
    for (std::size_t x = owner_.size(); x-- > 0;) {
      const auto& node = tree_.nodes()[x];
      if (node.right != 0) {
        owner_[x] = owner_[x + 1] == owner_[node.right] ? owner_[x + 1] : kNobody;
        continue;
      }
      owner_[x] = window_[order_[node.begin]];
      for (std::uint32_t k = node.begin; k < node.end; ++k) {
        if (window_[order_[k]] != owner_[x]) owner_[x] = kNobody;
      }
    }
  }

  /// Returns each point's distance to its nearest neighbour, capped at `most`.
  std::vector<double> nearest(std::span<const double> most) const {
    std::vector<double> result(points_.size(), 0.0);
    for_each_chunk([&](std::uint32_t k, std::vector<std::uint32_t>&) {
      std::vector<std::pair<double, std::uint32_t>> found;
      tree_.nearest(k, 1, found);
      const std::uint32_t i = order_[k];
      const double apart = found.empty() ? most[i] : distance(i, order_[found[0].second]);
      result[i] = std::min(apart, most[i]);
    });
    return result;
  }

  /// Returns, for each point i, the largest share * (own[i] + others[j] - distance) over the points
  /// j of other windows, or 0 if that is negative.
  std::vector<double> operator()(std::span<const double> own, std::span<const double> others,
                                 double share) {
    const auto& nodes = tree_.nodes();
    for (std::size_t x = nodes.size(); x-- > 0;) {
      const auto& node = nodes[x];
      if (node.right != 0) {
        largest_[x] = std::max(largest_[x + 1], largest_[node.right]);
        continue;
      }
      largest_[x] = others[order_[node.begin]];
      for (std::uint32_t k = node.begin; k < node.end; ++k) {
        largest_[x] = std::max(largest_[x], others[order_[k]]);
      }
    }
    std::vector<double> result(points_.size(), 0.0);
    for_each_chunk([&](std::uint32_t k, std::vector<std::uint32_t>& open) {
      const std::uint32_t i = order_[k];
      double most = 0.0;
      open.assign(1, 0);
      while (!open.empty()) {
        const std::uint32_t x = open.back();
        open.pop_back();
        if (owner_[x] == window_[i]) continue;
        const auto& node = nodes[x];
        const double apart = std::sqrt(node.box.squared_distance(points_[i])) * (1.0 - 1e-13);
        const double least = metric_.distance ? metric_.factor * apart - metric_.offset : apart;
        if (own[i] + largest_[x] - least <= most) continue;
        if (node.right != 0) {
          open.push_back(node.right);
          open.push_back(x + 1);
          continue;
        }
        for (std::uint32_t at = node.begin; at < node.end; ++at) {
          const std::uint32_t j = order_[at];
          if (window_[j] != window_[i]) most = std::max(most, own[i] + others[j] - distance(i, j));
        }
      }
      result[i] = share * most;
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
  std::vector<std::uint32_t> owner_;  // for each box: its window, if all its points are in the same
  std::vector<double> largest_;       // for each box: the largest of `others` in it
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
  // The vertex for nobody is at distance 0 from all points, so leaving a point over costs its
  // radius.
  return sum - *std::max_element(radius_.begin(), radius_.end());
}

template double Discs::bound(std::span<const Point2>, const PointMetric&, unsigned,
                             const base::StopCheck&);
template double Discs::bound(std::span<const Point3>, const PointMetric&, unsigned,
                             const base::StopCheck&);

}  // namespace terrace::matching::windows
