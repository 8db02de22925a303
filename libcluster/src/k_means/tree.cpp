// SPDX-License-Identifier: Apache-2.0
#include "k_means/tree.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include <terrace/base/stop_check.hpp>

namespace terrace::cluster {
namespace {

constexpr unsigned kAxisBits = 20;

/// Spreads the lowest twenty bits, with a gap of one bit after each.
std::uint64_t spread_bits_by_one(std::uint64_t v) {
  v = (v | v << 16) & 0x0000FFFF0000FFFF;
  v = (v | v << 8) & 0x00FF00FF00FF00FF;
  v = (v | v << 4) & 0x0F0F0F0F0F0F0F0F;
  v = (v | v << 2) & 0x3333333333333333;
  return (v | v << 1) & 0x5555555555555555;
}
/// Spreads the lowest twenty bits, with a gap of two bits after each.
std::uint64_t spread_bits_by_two(std::uint64_t v) {
  v = (v | v << 32) & 0x001F00000000FFFF;
  v = (v | v << 16) & 0x001F0000FF0000FF;
  v = (v | v << 8) & 0x100F00F00F00F00F;
  v = (v | v << 4) & 0x10C30C30C30C30C3;
  return (v | v << 2) & 0x1249249249249249;
}

struct Keyed {
  std::uint64_t key;
  std::uint32_t index;
};

/// Sorts stably by the lowest `bits` bits of the keys.
void radix_sort(std::vector<Keyed>& items, unsigned bits, const base::StopCheck& check_stop) {
  constexpr unsigned kKeyDigitBits = 10;
  constexpr std::size_t kKeyDigits = std::size_t{1} << kKeyDigitBits;
  std::vector<Keyed> other(items.size());
  for (unsigned shift = 0; shift < bits; shift += kKeyDigitBits) {
    if (check_stop) check_stop();
    std::array<std::size_t, kKeyDigits> offset{};
    for (const Keyed& item : items) ++offset[(item.key >> shift) % kKeyDigits];
    std::size_t sum = 0;
    for (std::size_t& p : offset) sum += std::exchange(p, sum);
    for (const Keyed& item : items) other[offset[(item.key >> shift) % kKeyDigits]++] = item;
    items.swap(other);
  }
}

/// Returns the parent of the nodes.
KMeansTree::Node join_nodes(std::span<const KMeansTree::Node> children) {
  KMeansTree::Node node = children.front();
  for (const KMeansTree::Node& child : children.subspan(1)) {
    for (unsigned axis = 0; axis < 3; ++axis) {
      node.sum[axis] += child.sum[axis];
    }
    node.box.include(child.box);
    node.weight += child.weight;
  }
  node.diagonal2 = 0;
  for (unsigned axis = 0; axis < 3; ++axis) {
    const double side = node.box.max[axis] - node.box.min[axis];
    node.diagonal2 += side * side;
  }
  return node;
}

}  // namespace

KMeansTree::KMeansTree(std::span<const Point3> points, std::span<const double> weights,
                       const Scaling& scaling, const base::StopCheck& check_stop)
    : count(points.size()) {
  const bool flat = scaling.extent[2] == 0.0;
  std::vector<Keyed> order(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Point3 p = scaling.scaled(points[i]);
    const auto cell = [&](unsigned axis) {
      return std::min(static_cast<std::uint64_t>(p[axis] * (1u << kAxisBits)),
                      (std::uint64_t{1} << kAxisBits) - 1);
    };
    const std::uint64_t key = flat
                                  ? spread_bits_by_one(cell(0)) | spread_bits_by_one(cell(1)) << 1
                                  : spread_bits_by_two(cell(0)) | spread_bits_by_two(cell(1)) << 1 |
                                        spread_bits_by_two(cell(2)) << 2;
    order[i] = {key, static_cast<std::uint32_t>(i)};
  }
  radix_sort(order, (flat ? 2 : 3) * kAxisBits, check_stop);
  base::StopTicks ticks(check_stop);

  const std::size_t blocks = (count + kBlock - 1) / kBlock;
  for (std::vector<double>* column : {&x, &y, &z, &w}) column->resize(blocks * kBlock);
  original.resize(count);
  for (std::size_t position = 0; position < blocks * kBlock; ++position) {
    ticks(8);
    const std::uint32_t i = order[std::min(position, count - 1)].index;
    const Point3 p = scaling.scaled(points[i]);
    x[position] = p[0];
    y[position] = p[1];
    z[position] = p[2];
    if (position < count) {
      original[position] = i;
      w[position] = weights.empty() ? 1.0 : weights[i];
    }
  }

  std::vector<Node> level(blocks);
  for (std::size_t b = 0; b < blocks; ++b) {
    ticks(4 * kBlock);
    std::array<Node, kBlock> single;
    for (std::size_t k = 0; k < kBlock; ++k) {
      const std::size_t position = b * kBlock + k;
      const Point3 p = point(position);
      single[k] = {
          {p, p}, 0.0, {w[position] * p[0], w[position] * p[1], w[position] * p[2]}, w[position]};
    }
    level[b] = join_nodes(single);
  }
  while (level.size() > 1) {
    std::vector<Node> parents((level.size() + kFan - 1) / kFan);
    for (std::size_t k = 0; k < parents.size(); ++k) {
      const std::size_t first = k * kFan;
      parents[k] = join_nodes(
          std::span<const Node>(level).subspan(first, std::min(kFan, level.size() - first)));
    }
    levels.push_back(std::exchange(level, std::move(parents)));
  }
  levels.push_back(std::move(level));
}

std::size_t KMeansTree::first_block(std::size_t level, std::size_t node) const {
  for (; level > 0; --level) node *= kFan;
  return std::min(node, block_count());
}

}  // namespace terrace::cluster
