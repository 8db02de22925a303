// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <stop_token>
#include <utility>

#include <terrace/cluster/hierarchy.hpp>
#include <terrace/stream/store.hpp>

namespace terrace::terrain {

/// Passes the finished blocks of libcluster's hierarchy builder to libstream's store writer. Blocks
/// are encoded on the thread that clustered them and appended in order. The two libraries do not
/// know each other.
class StoreSink final : public cluster::HierarchySink {
 public:
  /// The writer must outlive the sink. publish: false for a trial. stop: ends the build with
  /// stream::Stopped; each thread completes its current block first.
  /// surface: see stream::StoreWriter::finish().
  explicit StoreSink(stream::StoreWriter& writer, bool publish = true, std::stop_token stop = {},
                     stream::StoreWriter::MakeSurface surface = {})
      : writer_(writer), publish_(publish), stop_(std::move(stop)), surface_(std::move(surface)) {}

  std::unique_ptr<Prepared> prepare(const cluster::ClusteredBlock& block) override;
  void commit(unsigned level, std::unique_ptr<Prepared> prepared) override;
  /// Finishes the store. On return it is published under its name, unless it is a trial.
  void root(const cluster::ClusteredBlock& block) override;

  /// Bytes of the finished store; 0 before root().
  [[nodiscard]] std::uint64_t store_bytes() const { return store_bytes_; }

 private:
  stream::StoreWriter& writer_;
  bool publish_;
  std::stop_token stop_;
  stream::StoreWriter::MakeSurface surface_;
  std::uint64_t store_bytes_ = 0;
};

}  // namespace terrace::terrain
