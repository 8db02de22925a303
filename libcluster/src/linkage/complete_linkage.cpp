// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>

#include <terrace/base/stop_check.hpp>

#include "linkage/complete_rounds.hpp"
#include "linkage/points.hpp"
#include "linkage/tree.hpp"
#include "terrace/cluster/linkage.hpp"

namespace terrace::cluster {
namespace {

template <class T>
Dendrogram cluster_points(std::span<const Point3> points, const LinkageOptions& options) {
  const LinkageKernels<T>& kernels = linkage_kernels<T>(options.path);
  const LinkagePoints linkage_points(points);
  BandMatrix<T> matrix(points.size(), options.memory_limit);
  if (points.size() < 2) return make_dendrogram(points.size(), {});
  // In the order of a kd-tree, most clusters that merge have nearby rows in the matrix.
  std::vector<std::uint32_t> all(points.size());
  std::iota(all.begin(), all.end(), 0u);
  const LinkageTree tree(linkage_points.scaled(), all, options.threads, options.check_stop);
  const double* const x = tree.axis(0);
  const double* const y = tree.axis(1);
  const double* const z = tree.axis(2);
  CompleteRounds<T> rounds(matrix, kernels, options);
  std::vector<Link> links = rounds.run([&](std::size_t i, T* row) {
    const std::size_t until_end = std::min(matrix.width(), points.size() - 1 - i);
    kernels.distances(x + i + 1, y + i + 1, z + i + 1, until_end, x[i], y[i], z[i], row);
    kernels.distances(x, y, z, matrix.width() - until_end, x[i], y[i], z[i], row + until_end);
  });
  for (Link& link : links) {
    link = {tree.number(link.i), tree.number(link.j), linkage_points.height(link.height)};
  }
  return make_dendrogram(points.size(), links, options.check_stop);
}

/// Sorts items so that items at a small distance are close in the order. Divides them recursively
/// into halves that are nearer to one of two distant pivots. Calls `distance` three times per item
/// and level.
void order_by_distance(std::span<std::uint32_t> order, const PairDistance& distance) {
  constexpr std::size_t kSmallest = 8;
  if (order.size() <= kSmallest) return;
  struct Item {
    double key;
    std::uint32_t index;
  };
  std::vector<Item> items(order.size());
  const auto measure_from = [&](std::uint32_t pivot, double sign) {
    for (std::size_t i = 0; i < order.size(); ++i) {
      const double d = order[i] == pivot ? 0.0 : distance(pivot, order[i]);
      items[i] = {sign * d + (sign < 0 ? items[i].key : 0.0), order[i]};
    }
  };
  const auto farthest = [&] {
    return std::max_element(items.begin(), items.end(),
                            [](const Item& x, const Item& y) { return x.key < y.key; })
        ->index;
  };
  measure_from(order.front(), 1.0);
  const std::uint32_t pivot = farthest();
  measure_from(pivot, 1.0);
  measure_from(farthest(), -1.0);
  const std::size_t half = order.size() / 2;
  std::nth_element(items.begin(), items.begin() + static_cast<std::ptrdiff_t>(half), items.end(),
                   [](const Item& x, const Item& y) {
                     return x.key < y.key || (x.key == y.key && x.index < y.index);
                   });
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = items[i].index;
  // The contents of a half do not depend on how the library finds a median, but their order would.
  std::sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(half));
  std::sort(order.begin() + static_cast<std::ptrdiff_t>(half), order.end());
  order_by_distance(order.first(half), distance);
  order_by_distance(order.subspan(half), distance);
}

template <class T>
Dendrogram cluster_items(std::size_t count, const PairDistance& distance,
                         const LinkageOptions& options) {
  const LinkageKernels<T>& kernels = linkage_kernels<T>(options.path);
  BandMatrix<T> matrix(count, options.memory_limit);
  const auto checked = [&](std::uint32_t i, std::uint32_t j) {
    const double value = distance(std::min(i, j), std::max(i, j));
    check_distance(value, std::numeric_limits<T>::max(), i, j);
    return value;
  };
  // As for points, clusters that merge should have nearby rows in the matrix.
  std::vector<std::uint32_t> order(count);
  std::iota(order.begin(), order.end(), 0u);
  base::StopTicks ticks(options.check_stop);
  order_by_distance(order, [&](std::uint32_t i, std::uint32_t j) {
    ticks(kTicksOfDistance);
    return checked(i, j);
  });
  CompleteRounds<T> rounds(matrix, kernels, options);
  std::vector<Link> links = rounds.run([&](std::size_t i, T* row) {
    // Second copies of a pair are never read.
    const bool second_copy = count % 2 == 0 && i >= count / 2;
    for (std::size_t k = 0; k < matrix.width() - (second_copy ? 1 : 0); ++k) {
      row[k] = static_cast<T>(checked(order[i], order[band_partner(count, {i, k})]));
    }
  });
  for (Link& link : links) link = {order[link.i], order[link.j], link.height};
  return make_dendrogram(count, links, options.check_stop);
}

}  // namespace

Dendrogram complete_linkage(std::span<const Point3> points, const LinkageOptions& options) {
  return options.entry == MatrixEntry::float32 ? cluster_points<float>(points, options)
                                               : cluster_points<double>(points, options);
}

Dendrogram complete_linkage(std::size_t count, const PairDistance& distance,
                            const LinkageOptions& options) {
  return options.entry == MatrixEntry::float32 ? cluster_items<float>(count, distance, options)
                                               : cluster_items<double>(count, distance, options);
}

template <class T>
Dendrogram complete_linkage(BandMatrix<T>&& distances, const LinkageOptions& options) {
  const std::size_t n = distances.size();
  for (std::size_t i = 0; n % 2 == 0 && i < n / 2; ++i) {
    const std::size_t j = i + n / 2;
    if (distances.at(i, j) != distances.at(j, i)) {
      throw std::invalid_argument(pair_text(i, j) +
                                  " is in the matrix twice, with different values");
    }
  }
  CompleteRounds<T> rounds(distances, linkage_kernels<T>(options.path), options);
  const std::vector<Link> links = rounds.run([&](std::size_t i, const T* row) {
    for (std::size_t k = 0; k < distances.width(); ++k) {
      check_distance(row[k], std::numeric_limits<T>::max(), i, band_partner(n, {i, k}));
    }
  });
  return make_dendrogram(n, links, options.check_stop);
}

template Dendrogram complete_linkage(BandMatrix<float>&&, const LinkageOptions&);
template Dendrogram complete_linkage(BandMatrix<double>&&, const LinkageOptions&);

}  // namespace terrace::cluster
