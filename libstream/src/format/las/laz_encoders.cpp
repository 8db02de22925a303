// SPDX-License-Identifier: Apache-2.0
#include "format/las/laz_encoders.hpp"

#include <memory>
#include <utility>

namespace terrace::stream {

LazEncoders::LazEncoders(const laz::Vlr& vlr, unsigned threads, Write write)
    : write_(std::move(write)), queue_(threads, [vlr] {
        return [encoder = std::make_shared<laz::Encoder>(vlr)](Chunk& chunk) {
          chunk.coded.clear();
          encoder->encode_chunk(chunk.records, chunk.coded);
        };
      }) {
  if (threads <= 1) encoder_.emplace(vlr);
}

void LazEncoders::encode(std::span<const std::byte> records) {
  if (encoder_) {
    coded_.clear();
    encoder_->encode_chunk(records, coded_);
    write_(coded_);
    return;
  }
  while (queue_.size() > queue_.threads()) deliver_oldest();
  Chunk chunk;
  if (!free_chunks_.empty()) {
    chunk = std::move(free_chunks_.back());
    free_chunks_.pop_back();
  }
  chunk.records.assign(records.begin(), records.end());
  queue_.give(std::move(chunk));
  // If the system grants no threads, the queue encodes on this thread.
  if (queue_.threads() == 0) deliver_oldest();
}

void LazEncoders::finish() {
  while (queue_.size() > 0) deliver_oldest();
}

void LazEncoders::deliver_oldest() {
  Chunk chunk = queue_.take();
  write_(chunk.coded);
  free_chunks_.push_back(std::move(chunk));
}

}  // namespace terrace::stream
