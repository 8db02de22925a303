// SPDX-License-Identifier: Apache-2.0
#include "terrace/tri/interpolation.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <stdexcept>
#include <string>

#include <terrace/base/parallel.hpp>
#include <terrace/base/portable_math.hpp>

#include "check_input.hpp"
#include "curve_sort.hpp"
#include "delaunay2/access.hpp"
#include "interpolation/sampler.hpp"

namespace terrace::tri {
namespace {

/// Queries sorted at a time, to bound memory.
constexpr std::size_t kSorted = std::size_t{1} << 24;
/// Queries per block of work. The first query of a block searches from afar.
constexpr std::size_t kBlock = 8192;

void check_queries(std::span<const Point2> queries) {
  for (std::size_t i = 0; i < queries.size(); ++i) {
    if (planar::DoubleKernel::valid(queries[i])) continue;
    throw std::invalid_argument(
        "query " + std::to_string(i) + ": coordinates " + std::to_string(queries[i][0]) + ", " +
        std::to_string(queries[i][1]) + " are not finite; leave such queries out");
  }
}

/// Computes results[i] = answer(sampler, queries[i]), in an order in which successive queries are
/// close.
template <class Mesh, class Result, class Answer>
void answer_all(const Mesh& mesh, std::span<const Point2> queries, std::vector<Result>& results,
                unsigned threads, Answer answer) {
  using Sampler = planar::Sampler<typename Mesh::Kernel>;
  if (mesh.vertex_count == 0) return;
  for (std::size_t done = 0; done < queries.size(); done += kSorted) {
    const auto part = queries.subspan(done, std::min(kSorted, queries.size() - done));
    const auto order = hilbert_order<Point2>(part);
    base::parallel_blocks(
        part.size(), kBlock, threads, [&] { return std::make_unique<Sampler>(mesh); },
        [&](std::size_t begin, std::size_t end, std::unique_ptr<Sampler>& sampler) {
          sampler->start_at(planar::kNone);
          constexpr std::size_t kAhead = 16;
          for (std::size_t i = begin; i < end; ++i) {
            if (i + kAhead < end)
              __builtin_prefetch(&part[order[static_cast<std::uint32_t>(i + kAhead)]]);
            const std::uint32_t query = order[static_cast<std::uint32_t>(i)];
            results[done + query] = answer(*sampler, part[query]);
          }
        });
  }
}

}  // namespace

template <class Coord>
void weights_at(const Delaunay2<Coord>& triangulation, const Point2& query, Interpolation method,
                std::vector<VertexWeight>& weights, VertexId hint) {
  assert(hint == kNoVertex || triangulation.alive(hint));
  check_queries(std::span(&query, 1));
  weights.clear();
  const auto& mesh = Delaunay2Access::mesh(triangulation);
  if (mesh.vertex_count == 0) return;
  using Kernel = typename std::remove_cvref_t<decltype(mesh)>::Kernel;
  planar::Sampler<Kernel> sampler(mesh);
  sampler.start_at(slot(hint));
  const auto result = sampler.compute_weights(query, method);
  weights.assign(result.begin(), result.end());
}

template <class Coord>
std::vector<double> heights_at(const Delaunay2<Coord>& triangulation, const Heights& heights,
                               std::span<const Point2> queries, Interpolation method,
                               unsigned threads) {
  check_heights(triangulation, heights);
  check_queries(queries);
  constexpr double kNoValue = std::numeric_limits<double>::quiet_NaN();
  std::vector<double> results(queries.size(), kNoValue);
  answer_all(Delaunay2Access::mesh(triangulation), queries, results, threads,
             [&](auto& sampler, const Point2& query) {
               const auto weights = sampler.compute_weights(query, method);
               if (weights.empty()) return kNoValue;
               double sum = 0;
               for (const auto& [vertex, weight] : weights) sum += weight * heights(vertex);
               return sum;
             });
  return results;
}

template <class Coord>
std::vector<Gradient> gradients_at(const Delaunay2<Coord>& triangulation, const Heights& heights,
                                   std::span<const Point2> queries, GradientFrom from,
                                   unsigned threads) {
  check_heights(triangulation, heights);
  check_queries(queries);
  std::vector<Gradient> results(queries.size());
  answer_all(
      Delaunay2Access::mesh(triangulation), queries, results, threads,
      [&](auto& sampler, const Point2& query) { return sampler.gradient(query, heights, from); });
  return results;
}

double slope_degrees(const Gradient& gradient) {
  return base::atan2_degrees(base::hypot(gradient.x, gradient.y), 1);
}

double aspect_degrees(const Gradient& gradient) {
  if (gradient.x == 0 && gradient.y == 0) return std::numeric_limits<double>::quiet_NaN();
  const double degrees = base::atan2_degrees(-gradient.x, -gradient.y);
  // A tiny negative angle would round to 360.
  return !(degrees < 0) ? degrees + 0.0 : degrees + 360 < 360 ? degrees + 360 : 0;
}

#define TERRACE_TRI_DEFINE(Coord)                                                            \
  template void weights_at(const Delaunay2<Coord>&, const Point2&, Interpolation,            \
                           std::vector<VertexWeight>&, VertexId);                            \
  template std::vector<double> heights_at(const Delaunay2<Coord>&, const Heights&,           \
                                          std::span<const Point2>, Interpolation, unsigned); \
  template std::vector<Gradient> gradients_at(const Delaunay2<Coord>&, const Heights&,       \
                                              std::span<const Point2>, GradientFrom, unsigned);
TERRACE_TRI_DEFINE(std::int32_t)
TERRACE_TRI_DEFINE(double)
#undef TERRACE_TRI_DEFINE

}  // namespace terrace::tri
