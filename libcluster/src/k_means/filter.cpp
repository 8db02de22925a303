// SPDX-License-Identifier: Apache-2.0
#include "k_means/filter.hpp"

#include <algorithm>
#include <array>

#include <terrace/base/stop_check.hpp>
#include <terrace/base/thread_team.hpp>

namespace terrace::cluster {
namespace {

/// Returns the level whose nodes threads divide among them. Its chunks are long compared with k, so
/// that their sums take less memory than the points.
std::size_t chunk_level(const KMeansTree& tree, std::size_t clusters) {
  const std::size_t min_points = std::max<std::size_t>(8192, 4 * clusters);
  std::size_t level = 0;
  for (std::size_t points = KMeansTree::kBlock;
       points < min_points && level + 1 < tree.levels.size(); ++level) {
    points *= KMeansTree::kFan;
  }
  return level;
}

template <int D>
double distance2(double ax, double ay, double az, double bx, double by, double bz) {
  const double x = ax - bx;
  const double y = ay - by;
  double sum = x * x + y * y;
  if constexpr (D == 3) {
    const double z = az - bz;
    sum += z * z;
  }
  return sum;
}

}  // namespace

KMeansFilter::KMeansFilter(const KMeansTree& tree, std::size_t clusters, base::ThreadTeam& team,
                           const base::StopCheck& check_stop)
    : tree_(tree),
      clusters_(clusters),
      team_(team),
      chunk_level_(chunk_level(tree, clusters)),
      cluster_(tree.block_count() * KMeansTree::kBlock, kMixed),
      owner_(tree.block_count(), kMixed),
      sums_(clusters),
      chunk_sums_(clusters * tree.levels[chunk_level_].size()),
      scratch_(team.threads(), Scratch(check_stop)) {
  for (Scratch& scratch : scratch_) {
    const std::size_t size = (chunk_level_ + 2) * clusters;
    scratch.x.resize(size);
    scratch.y.resize(size);
    scratch.z.resize(size);
    scratch.number.resize(size);
  }
}

KMeansFilter::Candidates KMeansFilter::candidate_buffer(Scratch& scratch, std::size_t level) const {
  const std::size_t offset = level * clusters_;
  return {&scratch.x[offset], &scratch.y[offset], &scratch.z[offset], &scratch.number[offset], 0};
}

bool KMeansFilter::assign(std::span<const Point3> centres) {
  const KMeansTree::Node& root = tree_.levels.back().front();
  bool flat = root.box.max[2] == 0.0;
  for (const Point3& c : centres) flat = flat && c[2] == 0.0;
  for (Scratch& scratch : scratch_) {
    scratch.changed = false;
    const Candidates all = candidate_buffer(scratch, chunk_level_ + 1);
    for (std::uint32_t c = 0; c < centres.size(); ++c) {
      all.x[c] = centres[c][0];
      all.y[c] = centres[c][1];
      all.z[c] = centres[c][2];
      all.number[c] = c;
    }
  }
  const std::size_t chunks = tree_.levels[chunk_level_].size();
  team_.run(chunks, [&](std::size_t chunk, unsigned thread) {
    const std::span<Sum> sums(chunk_sums_.data() + chunk * clusters_, clusters_);
    std::fill(sums.begin(), sums.end(), Sum{});
    Candidates all = candidate_buffer(scratch_[thread], chunk_level_ + 1);
    all.count = centres.size();
    if (flat) {
      visit<2>(chunk_level_, chunk, all, scratch_[thread], sums);
    } else {
      visit<3>(chunk_level_, chunk, all, scratch_[thread], sums);
    }
  });
  std::fill(sums_.begin(), sums_.end(), Sum{});
  for (std::size_t chunk = 0; chunk < chunks; ++chunk) {
    for (std::size_t c = 0; c < clusters_; ++c) {
      const Sum& part = chunk_sums_[chunk * clusters_ + c];
      for (unsigned axis = 0; axis < 3; ++axis) sums_[c].sum[axis] += part.sum[axis];
      sums_[c].weight += part.weight;
    }
  }
  return std::any_of(scratch_.begin(), scratch_.end(), [](const Scratch& s) { return s.changed; });
}

template <int D>
void KMeansFilter::visit(std::size_t level, std::size_t index, const Candidates& candidates,
                         Scratch& scratch, std::span<Sum> sums) {
  scratch.ticks(candidates.count);
  const KMeansTree::Node& node = tree_.levels[level][index];
  const double mx = 0.5 * (node.box.min[0] + node.box.max[0]);
  const double my = 0.5 * (node.box.min[1] + node.box.max[1]);
  const double mz = 0.5 * (node.box.min[2] + node.box.max[2]);
  double least = distance2<D>(mx, my, mz, candidates.x[0], candidates.y[0], candidates.z[0]);
  std::size_t best = 0;
  for (std::size_t k = 1; k < candidates.count; ++k) {
    const double d = distance2<D>(mx, my, mz, candidates.x[k], candidates.y[k], candidates.z[k]);
    best = d < least ? k : best;
    least = std::min(least, d);
  }

  // Compares each centre c with the best. |p - c|^2 - |p - best|^2 is linear in p and has its
  // minimum at the corner that is farthest in the direction from the best to c. The margin covers
  // the rounding errors of both squares anywhere in the box.
  const double bx = candidates.x[best];
  const double by = candidates.y[best];
  const double bz = candidates.z[best];
  Candidates remaining = candidate_buffer(scratch, level);
  for (std::size_t k = 0; k < candidates.count; ++k) {
    const double x = candidates.x[k];
    const double y = candidates.y[k];
    const double z = candidates.z[k];
    const double px = x > bx ? node.box.max[0] : node.box.min[0];
    const double py = y > by ? node.box.max[1] : node.box.min[1];
    const double pz = z > bz ? node.box.max[2] : node.box.min[2];
    const double to_centre = distance2<D>(px, py, pz, x, y, z);
    const double to_best = distance2<D>(px, py, pz, bx, by, bz);
    remaining.x[remaining.count] = x;
    remaining.y[remaining.count] = y;
    remaining.z[remaining.count] = z;
    remaining.number[remaining.count] = candidates.number[k];
    const double margin = 4e-15 * (to_centre + to_best + 2 * node.diagonal2);
    remaining.count += to_centre - to_best > margin ? 0 : 1;
  }

  if (remaining.count == 1) {
    assign_node(level, index, remaining.number[0], scratch, sums);
  } else if (level == 0) {
    assign_block<D>(index, remaining, scratch, sums);
  } else {
    const std::size_t first = index * KMeansTree::kFan;
    const std::size_t end = std::min(first + KMeansTree::kFan, tree_.levels[level - 1].size());
    for (std::size_t child = first; child < end; ++child) {
      visit<D>(level - 1, child, remaining, scratch, sums);
    }
  }
}

void KMeansFilter::assign_node(std::size_t level, std::size_t index, std::uint32_t cluster,
                               Scratch& scratch, std::span<Sum> sums) {
  const KMeansTree::Node& node = tree_.levels[level][index];
  for (unsigned axis = 0; axis < 3; ++axis) sums[cluster].sum[axis] += node.sum[axis];
  sums[cluster].weight += node.weight;
  const std::size_t end = tree_.first_block(level, index + 1);
  for (std::size_t b = tree_.first_block(level, index); b < end; ++b) {
    if (owner_[b] == cluster) continue;
    owner_[b] = cluster;
    for (std::size_t position = b * KMeansTree::kBlock; position < (b + 1) * KMeansTree::kBlock;
         ++position) {
      scratch.changed = scratch.changed || cluster_[position] != cluster;
      cluster_[position] = cluster;
    }
  }
}

template <int D>
void KMeansFilter::assign_block(std::size_t block, const Candidates& candidates, Scratch& scratch,
                                std::span<Sum> sums) {
  scratch.ticks(KMeansTree::kBlock * candidates.count);
  const double* const x = &tree_.x[block * KMeansTree::kBlock];
  const double* const y = &tree_.y[block * KMeansTree::kBlock];
  const double* const z = &tree_.z[block * KMeansTree::kBlock];
  const double* const w = &tree_.w[block * KMeansTree::kBlock];
  std::array<double, KMeansTree::kBlock> least;
  // Doubles, because the selection below works on vectors of doubles.
  std::array<double, KMeansTree::kBlock> nearest{};
  for (std::size_t i = 0; i < KMeansTree::kBlock; ++i) {
    least[i] = distance2<D>(x[i], y[i], z[i], candidates.x[0], candidates.y[0], candidates.z[0]);
  }
  for (std::size_t k = 1; k < candidates.count; ++k) {
    const double cx = candidates.x[k];
    const double cy = candidates.y[k];
    const double cz = candidates.z[k];
    const auto number = static_cast<double>(k);
    for (std::size_t i = 0; i < KMeansTree::kBlock; ++i) {
      const double d = distance2<D>(x[i], y[i], z[i], cx, cy, cz);
      nearest[i] = d < least[i] ? number : nearest[i];
      least[i] = d < least[i] ? d : least[i];
    }
  }
  std::uint32_t* const cluster = &cluster_[block * KMeansTree::kBlock];
  bool changed = false;
  for (std::size_t i = 0; i < KMeansTree::kBlock; ++i) {
    const std::uint32_t c = candidates.number[static_cast<std::size_t>(nearest[i])];
    changed = changed || cluster[i] != c;
    cluster[i] = c;
    Sum& sum = sums[c];
    sum.sum[0] += w[i] * x[i];
    sum.sum[1] += w[i] * y[i];
    if constexpr (D == 3) sum.sum[2] += w[i] * z[i];
    sum.weight += w[i];
  }
  scratch.changed = scratch.changed || changed;
  owner_[block] = kMixed;
}

void KMeansFilter::move_point(std::size_t position, std::uint32_t cluster) {
  cluster_[position] = cluster;
  owner_[position / KMeansTree::kBlock] = kMixed;
  // The copies of the last point that fill the last block move with it, so that they do not count
  // as a change.
  if (position + 1 == tree_.count) {
    std::fill(cluster_.begin() + static_cast<std::ptrdiff_t>(position), cluster_.end(), cluster);
  }
}

}  // namespace terrace::cluster
