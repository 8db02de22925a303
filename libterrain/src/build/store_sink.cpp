// SPDX-License-Identifier: Apache-2.0
#include "terrace/terrain/store_sink.hpp"

#include <utility>

#include <terrace/stream/error.hpp>

namespace terrace::terrain {
namespace {

struct EncodedBlock final : cluster::HierarchySink::Prepared {
  explicit EncodedBlock(stream::StoreWriter::EncodedPtr encoded) : block(std::move(encoded)) {}
  stream::StoreWriter::EncodedPtr block;
};

}  // namespace

std::unique_ptr<cluster::HierarchySink::Prepared> StoreSink::prepare(
    const cluster::ClusteredBlock& block) {
  if (stop_.stop_requested()) throw stream::Stopped();
  return std::make_unique<EncodedBlock>(writer_.encode(block));
}

void StoreSink::commit(unsigned /*level*/, std::unique_ptr<Prepared> prepared) {
  writer_.append(std::move(static_cast<EncodedBlock&>(*prepared).block));
}

void StoreSink::root(const cluster::ClusteredBlock& block) {
  store_bytes_ = writer_.finish(block, publish_, surface_);
}

}  // namespace terrace::terrain
