// SPDX-License-Identifier: Apache-2.0
#include "terrace/terrain/detail_points.hpp"

#include <cstddef>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace terrace::terrain {
namespace {

/// The wanted points of some clusters, encoded for a file.
class WrittenPart final : public WantedPart {
 public:
  /// The data that all threads share.
  struct Output {
    const stream::Store& store;
    WantedPoints wanted;
    const PlaceConversion& places;
    stream::PointWriter& writer;
    const Context& context;
    stream::Overlay* overlay = nullptr;      ///< requires a single thread
    std::uint64_t replaced = 0;              ///< number of heights from the overlay
    std::vector<stream::PointBlock> blocks;  ///< reused by each thread
  };

  WrittenPart(Output& output, unsigned worker) : output_(output), block_(output.blocks[worker]) {
    block_.clear();
  }

  void add(stream::ClusterId id, const stream::ClusterRecord& record,
           const stream::ClusterPoints& points) override {
    const std::size_t payload = output_.store.schema().payload_size();
    std::span<const stream::OverlayValue> heights;
    if (output_.overlay != nullptr) heights = output_.overlay->find(id);
    output_.wanted(record, points, [&](std::size_t i, stream::Point3 place) {
      while (!heights.empty() && heights.front().index < i) heights = heights.subspan(1);
      if (!heights.empty() && heights.front().index == i) {
        place[2] = heights.front().value;
        ++output_.replaced;
      }
      block_.positions.push_back(place);
      const std::byte* values = points.payload.data() + i * payload;
      block_.payload.insert(block_.payload.end(), values, values + payload);
    });
  }

  void end() override {
    if (block_.empty()) return;
    output_.places(block_.positions);
    encoded_ = output_.writer.encode(block_);
  }

  void take() override {
    output_.context.check_stop();
    if (encoded_ != nullptr) output_.writer.append(std::move(encoded_));
  }

 private:
  Output& output_;
  stream::PointBlock& block_;  ///< used until end()
  stream::PointWriter::EncodedPtr encoded_;
};

}  // namespace

std::uint64_t write_points(const stream::Store& store, const Detail& detail,
                           stream::PointWriter& writer, const PlaceConversion& places,
                           stream::Overlay* overlay, const Context& context) {
  const unsigned threads = overlay != nullptr ? 1 : context.threads;
  WrittenPart::Output output{.store = store,
                             .wanted = WantedPoints(store, detail),
                             .places = places,
                             .writer = writer,
                             .context = context,
                             .overlay = overlay,
                             .blocks = std::vector<stream::PointBlock>(threads)};
  for_each_wanted(store, detail, threads, [&output](unsigned worker) {
    return std::make_unique<WrittenPart>(output, worker);
  });
  return output.replaced;
}

}  // namespace terrace::terrain
