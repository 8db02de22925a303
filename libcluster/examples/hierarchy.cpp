// SPDX-License-Identifier: Apache-2.0
// Builds the hierarchy of a small terrain and reads it back: from the point of the top level that
// represents most of the terrain down to a point of full resolution.
#include "terrace/cluster/hierarchy.hpp"

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <map>
#include <memory>
#include <span>
#include <utility>
#include <vector>

using namespace terrace::cluster;

namespace {

/// Keeps clusters in memory. A real sink would pack them in prepare() and write them in commit().
class MemorySink : public HierarchySink {
 public:
  struct Cluster {
    std::vector<Point3> points;
    std::vector<std::uint64_t> children;  ///< one level below, per point; empty on level 0
    ClusterSummary summary;
  };

  std::unique_ptr<Prepared> prepare(const ClusteredBlock& block) override {
    auto clusters = std::make_unique<Clusters>();
    for (std::size_t c = 0; c < block.summaries.size(); ++c) {
      clusters->list.push_back(extract(block, c));
    }
    return clusters;
  }

  void commit(unsigned level, std::unique_ptr<Prepared> prepared) override {
    for (Cluster& cluster : static_cast<Clusters&>(*prepared).list) {
      levels[level].push_back(std::move(cluster));
    }
  }

  void root(const ClusteredBlock& block) override { top = extract(block, 0); }

  std::map<unsigned, std::vector<Cluster>> levels;  ///< by level and ordinal
  Cluster top;

 private:
  struct Clusters : Prepared {
    std::vector<Cluster> list;
  };

  static Cluster extract(const ClusteredBlock& block, std::size_t c) {
    Cluster cluster;
    cluster.summary = block.summaries[c];
    for (std::size_t k = block.first[c]; k < block.first[c + 1]; ++k) {
      const std::size_t i = block.order[k];
      cluster.points.push_back(block.positions[i]);
      if (block.level > 0) {
        cluster.children.push_back(block.children[i * block.level + block.level - 1]);
      }
    }
    return cluster;
  }
};

}  // namespace

int main() {
  MemorySink sink;
  HierarchyOptions options;
  options.block_size = 400;
  options.threads = 2;
  // Positions are in degrees and heights in metres, but clusters should be compact in metres.
  options.ground = [](const Box3& block) {
    constexpr double kDegree = 3.14159265358979323846 / 180;
    constexpr double kMetresPerDegree = 111195.0;
    const double latitude = 0.5 * (block.min[1] + block.max[1]);
    return GroundMap{
        kMetresPerDegree * std::cos(latitude * kDegree), 0, 0, 0, kMetresPerDegree, 0, 0, 0, 1};
  };

  HierarchyBuilder builder(options, sink);
  constexpr int kTiles = 10;
  constexpr int kTile = 20;  // 20 x 20 points form one block
  std::vector<Point3> tile;
  for (int t = 0; t < kTiles * kTiles; ++t) {
    tile.clear();
    for (int k = 0; k < kTile * kTile; ++k) {
      const double column = (t % kTiles) * kTile + k % kTile;
      const double row = (t / kTiles) * kTile + k / kTile;
      tile.push_back({7.0 + column / 3600, 46.0 + row / 3600,
                      500 + 200 * std::sin(0.05 * column) * std::cos(0.03 * row)});
    }
    builder.push(tile);
  }
  const HierarchyResult result = builder.finish();

  for (unsigned level = 0; level <= result.top; ++level) {
    std::printf("level %u: %llu points in %llu clusters\n", level,
                static_cast<unsigned long long>(result.level_points[level]),
                static_cast<unsigned long long>(result.level_clusters[level]));
  }

  // Goes down from the top, always into the first point's cluster.
  const MemorySink::Cluster* cluster = &sink.top;
  for (unsigned level = result.top; level > 0; --level) {
    cluster = &sink.levels.at(level - 1).at(cluster->children.front());
    std::printf("a cluster of level %u: %llu points of level 0 within %.1f m\n", level - 1,
                static_cast<unsigned long long>(cluster->summary.descendants),
                cluster->summary.error);
  }

  const bool complete = result.points == 40000 && sink.top.summary.descendants == 40000;
  return complete ? 0 : 1;
}
