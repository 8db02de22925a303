// SPDX-License-Identifier: Apache-2.0
#include "terrace/terrain/store_sink.hpp"

#include <utility>
#include <vector>

#include <terrace/stream/error.hpp>

namespace terrace::terrain {
namespace {

struct EncodedBlock final : cluster::HierarchySink::Prepared {
  explicit EncodedBlock(stream::StoreWriter::EncodedPtr encoded) : block(std::move(encoded)) {}
  stream::StoreWriter::EncodedPtr block;
};

std::vector<stream::ClusterSummary> summaries_of(const cluster::FinishedBlock& block) {
  std::vector<stream::ClusterSummary> summaries;
  summaries.reserve(block.summaries.size());
  for (const cluster::Summary& s : block.summaries) {
    summaries.push_back({{s.box.min, s.box.max}, s.error, s.descendants});
  }
  return summaries;
}

stream::ClusteredBlock as_stored(const cluster::FinishedBlock& block,
                                 const std::vector<stream::ClusterSummary>& summaries) {
  return {.level = block.level,
          .positions = block.positions,
          .payload = block.payload,
          .children = block.children,
          .first = block.first,
          .order = block.order,
          .representatives = block.representatives,
          .summaries = summaries};
}

}  // namespace

std::unique_ptr<cluster::HierarchySink::Prepared> StoreSink::prepare(
    const cluster::FinishedBlock& block) {
  if (stop_.stop_requested()) throw stream::Stopped();
  const auto summaries = summaries_of(block);
  return std::make_unique<EncodedBlock>(writer_.encode(as_stored(block, summaries)));
}

void StoreSink::commit(unsigned /*level*/, std::unique_ptr<Prepared> prepared) {
  writer_.append(std::move(static_cast<EncodedBlock&>(*prepared).block));
}

void StoreSink::root(const cluster::FinishedBlock& block) {
  const auto summaries = summaries_of(block);
  store_bytes_ = writer_.finish(as_stored(block, summaries), publish_);
}

}  // namespace terrace::terrain
