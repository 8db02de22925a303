// SPDX-License-Identifier: Apache-2.0
#include "terrace/tri/smoothing.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include <terrace/base/stop_check.hpp>

#include "check_input.hpp"
#include "delaunay2/access.hpp"
#include "interpolation/place.hpp"

namespace terrace::tri {
namespace {

constexpr std::uint32_t kOutside = 0xFFFFFFFFu;

/// The second step of Taubin's method: 1 / strength + 1 / step = pass band.
double second_step(const SmoothingOptions& options) {
  return -options.strength / (1 - options.pass_band * options.strength);
}

void check(const SmoothingOptions& options) {
  const auto require = [](bool good, const std::string& what) {
    if (!good) throw std::invalid_argument("smoothing: " + what);
  };
  require(options.strength > 0 && options.strength <= 1,
          "strength " + std::to_string(options.strength) + " is not in 0 < strength <= 1");
  if (options.method == Smoothing::bilateral)
    require(options.edge_height > 0, "edge_height " + std::to_string(options.edge_height) +
                                         " is not positive; give the smallest height difference "
                                         "to preserve");
  if (options.method != Smoothing::taubin) return;
  require(options.pass_band > 0 && options.pass_band < 1,
          "pass_band " + std::to_string(options.pass_band) + " is not in 0 < pass_band < 1");
  // The roughest component, of eigenvalue 2, must not grow.
  const double growth = (1 - 2 * options.strength) * (1 - 2 * second_step(options));
  require(std::abs(growth) <= 1, "strength " + std::to_string(options.strength) +
                                     " is too large for this method; use at most 0.6");
}

/// The vertices of a region as rows of a sparse matrix: first those that move, then those that
/// stay.
struct Rows {
  std::vector<std::uint32_t> vertex;
  std::size_t moving = 0;
  std::vector<std::size_t> begin;  ///< start of row i in the following arrays. One extra at the end
  std::vector<std::uint32_t> neighbour;
  std::vector<double> weight;  ///< >= 0. The sum per row is 1
};

/// Replaces positions by vectors from `origin`, scaled by one factor so that no component exceeds
/// 1. Angles do not change.
void scale(const planar::Query& origin, std::vector<planar::Query>& at) {
  bool huge = false;
  for (const auto& p : at)
    for (std::size_t k = 0; k < 2; ++k) huge = huge || !std::isfinite(p[k] - origin[k]);
  double largest = 0;
  for (auto& p : at) {
    for (std::size_t k = 0; k < 2; ++k) {
      p[k] = huge ? p[k] / 2 - origin[k] / 2 : p[k] - origin[k];
      largest = std::max(largest, std::abs(p[k]));
    }
  }
  for (auto& p : at)
    for (double& c : p) c /= largest;
}

/// Computes the weights of the neighbours of a vertex at the origin, scaled to sum 1: the sum of
/// the cotangents of the two angles opposite to an edge, which is twice the common side of the
/// Voronoi cells divided by the edge's length. Returns false if the sum is zero, infinite or NaN,
/// as for degenerate triangles.
bool compute_weights(const std::vector<planar::Query>& at, std::vector<double>& weights) {
  weights.assign(at.size(), 0);
  for (std::size_t i = 0; i < at.size(); ++i) {
    const std::size_t next = i + 1 == at.size() ? 0 : i + 1;
    const auto& [bx, by] = at[i];
    const auto& [cx, cy] = at[next];
    const double cross = bx * cy - by * cx;
    // The angle at c is opposite to the edge to b, the angle at b opposite to the edge to c.
    weights[i] += ((bx - cx) * -cx + (by - cy) * -cy) / cross;
    weights[next] += ((cx - bx) * -bx + (cy - by) * -by) / cross;
  }
  double sum = 0;
  for (double& w : weights) {
    w = std::isnan(w) ? w : std::max(w, 0.0);  // only rounding makes it negative
    sum += w;
  }
  for (double& w : weights) w /= sum;
  return sum > 0 && std::isfinite(sum);
}

template <class Mesh>
Rows make_rows(const Mesh& mesh, std::span<const VertexId> region, base::StopTicks& ticks) {
  Rows rows;
  for (const VertexId v : region) rows.vertex.push_back(slot(v));
  std::sort(rows.vertex.begin(), rows.vertex.end());
  rows.vertex.erase(std::unique(rows.vertex.begin(), rows.vertex.end()), rows.vertex.end());
  std::vector<std::uint32_t> row(mesh.point.size(), kOutside);
  for (const std::uint32_t v : rows.vertex) row[v] = 0;
  std::vector<std::uint32_t> fixed;
  std::vector<std::uint32_t> moving;
  std::vector<planar::Query> at;
  std::vector<double> weights;
  rows.begin.push_back(0);
  for (const std::uint32_t v : rows.vertex) {
    ticks(256);
    bool inside = !mesh.flat;
    at.clear();
    const std::size_t first = rows.neighbour.size();
    if (inside) {
      planar::for_each_triangle_at(mesh, v, [&](std::uint32_t t, std::uint32_t i) {
        const std::uint32_t u = mesh.triangle[t].corner[planar::next_index(i)];
        inside = inside && u != planar::kGhost && row[u] != kOutside;
        at.push_back(planar::to_query(mesh.point[u]));
        rows.neighbour.push_back(u);
      });
    }
    if (inside) {
      scale(planar::to_query(mesh.point[v]), at);
      inside = compute_weights(at, weights);
    }
    if (!inside) {
      rows.neighbour.resize(first);
      fixed.push_back(v);
      continue;
    }
    rows.weight.insert(rows.weight.end(), weights.begin(), weights.end());
    rows.begin.push_back(rows.neighbour.size());
    moving.push_back(v);
  }
  rows.vertex = moving;
  rows.moving = moving.size();
  rows.vertex.insert(rows.vertex.end(), fixed.begin(), fixed.end());
  for (std::uint32_t i = 0; i < rows.vertex.size(); ++i) row[rows.vertex[i]] = i;
  for (std::uint32_t& u : rows.neighbour) u = row[u];
  return rows;
}

/// Computes next = height + step * (mean of neighbours - height) for rows that move, then swaps
/// `height` and `next`. `influence(d)`: factor from 0 to 1 for a neighbour that is higher by d.
template <class Influence>
void apply_step(const Rows& rows, double step, std::vector<double>& height,
                std::vector<double>& next, Influence influence, base::StopTicks& ticks) {
  for (std::size_t i = 0; i < rows.moving; ++i) {
    ticks(4 * (rows.begin[i + 1] - rows.begin[i]));
    double sum = 0;
    double weights = 0;
    for (std::size_t k = rows.begin[i]; k < rows.begin[i + 1]; ++k) {
      const double difference = height[rows.neighbour[k]] - height[i];
      const double weight = rows.weight[k] * influence(difference);
      sum += weight * difference;
      weights += weight;
    }
    next[i] = weights > 0 ? height[i] + step * (sum / weights) : height[i];
  }
  height.swap(next);
}

}  // namespace

template <class Coord>
std::vector<HeightChange> smooth(const Delaunay2<Coord>& triangulation, const Heights& heights,
                                 std::span<const VertexId> region,
                                 const SmoothingOptions& options) {
  check(options);
  check_heights(triangulation, heights);
  base::StopTicks ticks(options.check_stop);
  const Rows rows = make_rows(Delaunay2Access::mesh(triangulation), region, ticks);
  std::vector<double> height;
  for (const std::uint32_t v : rows.vertex) {
    height.push_back(heights(VertexId{v}));
    if (!std::isfinite(height.back()))
      throw std::invalid_argument("smoothing: the height of vertex " + std::to_string(v) +
                                  " is not finite; leave it out of the region");
  }
  std::vector<double> next = height;
  const auto all = [](double) { return 1.0; };
  const auto similar = [&](double difference) {
    const double part = difference / options.edge_height;
    const double complement = 1 - part * part;
    return complement > 0 ? complement * complement : 0;
  };
  for (unsigned i = 0; i < options.iterations; ++i) {
    if (options.method == Smoothing::bilateral) {
      apply_step(rows, options.strength, height, next, similar, ticks);
    } else {
      apply_step(rows, options.strength, height, next, all, ticks);
      if (options.method == Smoothing::taubin)
        apply_step(rows, second_step(options), height, next, all, ticks);
    }
  }
  std::vector<HeightChange> changes;
  for (std::size_t i = 0; i < rows.moving; ++i)
    changes.push_back({VertexId{rows.vertex[i]}, height[i]});
  return changes;
}

template std::vector<HeightChange> smooth(const Delaunay2<std::int32_t>&, const Heights&,
                                          std::span<const VertexId>, const SmoothingOptions&);
template std::vector<HeightChange> smooth(const Delaunay2<double>&, const Heights&,
                                          std::span<const VertexId>, const SmoothingOptions&);

}  // namespace terrace::tri
