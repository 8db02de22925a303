// SPDX-License-Identifier: Apache-2.0
#include "terrace/cluster/hierarchy.hpp"

#include <memory>
#include <utility>

#include "hierarchy/engine.hpp"

namespace terrace::cluster {

struct HierarchyBuilder::Impl {
  HierarchyEngine engine;
};

HierarchyBuilder::HierarchyBuilder(HierarchyOptions options, HierarchySink& sink) {
  const SimdPath path = options.simd;
  const auto make_cluster = [path]() -> ClusterFunction {
    // Shared, because a std::function must be copyable and a clusterer is not.
    const auto clusterer = std::make_shared<BlockClusterer>(path);
    return [clusterer](std::span<const Point3> points, std::span<const double> weights,
                       const BlockOptions& block_options, BlockClustering& result) {
      clusterer->run(points, weights, block_options, result);
    };
  };
  impl_.reset(new Impl{{std::move(options), sink, make_cluster}});
}

HierarchyBuilder::~HierarchyBuilder() = default;

void HierarchyBuilder::push(std::span<const Point3> positions, std::span<const std::byte> payload) {
  impl_->engine.push(positions, payload);
}

void HierarchyBuilder::push_heads(const ClusterHeads& heads) { impl_->engine.push_heads(heads); }

HierarchyResult HierarchyBuilder::finish() { return impl_->engine.finish(); }

}  // namespace terrace::cluster
