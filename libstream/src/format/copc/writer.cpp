// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "format/copc/hierarchy.hpp"
#include "format/copc/octree_builder.hpp"
#include "format/las/header.hpp"
#include "format/las/laz_encoders.hpp"
#include "format/las/record_encoder.hpp"
#include "format/writers.hpp"
#include "io/bytes.hpp"
#include "io/temporary.hpp"
#include "io/text.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/laz.hpp"
#include "terrace/stream/sink.hpp"

namespace terrace::stream {
namespace {

std::string_view text_of_bytes(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// Returns the smallest cube around the records' points, starting at their lowest corner.
Octree cube_around(const LasRecords& records) {
  const Lattice& lattice = records.lattice();
  Box3 box;
  for (const auto& corner : {records.sums().lowest, records.sums().highest}) {
    if (records.sums().points == 0) continue;
    Point3 place{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      place[axis] = corner[axis] * lattice.scale[axis] + lattice.offset[axis];
    }
    box.include(place);
  }
  if (box.empty()) box.include(lattice.offset);
  Octree octree;
  double side = lattice.scale[0];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    // Slightly more than the points need, because sums of the cube's numbers are rounded.
    const double rounding = 0x1p-50 * (std::abs(box.min[axis]) + std::abs(box.max[axis]));
    side = std::max(side, box.max[axis] - box.min[axis] + 4 * rounding);
  }
  octree.half_size = 0.5 * side;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    octree.centre[axis] = box.min[axis] + octree.half_size;
  }
  octree.spacing = side / OctreeBuilder::kSpan;
  return octree;
}

/// How the parts of the writer share its memory. Results do not depend on it.
struct Shares {
  unsigned threads = 1;
  std::size_t batch_records = OctreeBuilder::kLeafPoints;  ///< records
  std::uint64_t deep_points = 0;                           ///< records at one place

  /// Upper bound of the memory held.
  [[nodiscard]] std::uint64_t bytes(std::size_t record_bytes) const {
    // Records and their coded bytes, of each thread and of a node that waits.
    const std::uint64_t node = 8 * OctreeBuilder::kMaxPromoted * record_bytes * 8 / 5;
    return OctreeBuilder::bytes_with(record_bytes, batch_records) +
           (threads > 1 ? threads + 1 : 1) * node;
  }
};

Shares shares_within(std::uint64_t memory_bytes, unsigned threads, std::size_t record_bytes) {
  constexpr std::size_t kMaxBatchRecords = std::size_t{1} << 19;
  constexpr std::uint64_t kMaxDeepPoints = 1u << 24;
  Shares shares;
  for (shares.threads = std::max(1u, threads);
       shares.threads > 1 && shares.bytes(record_bytes) > memory_bytes; --shares.threads) {
  }
  // A record at one place takes as much as any record in memory, and is encoded with the others.
  const std::uint64_t minimum = shares.bytes(record_bytes);
  const std::uint64_t room = memory_bytes - std::min(memory_bytes, minimum);
  const std::uint64_t each =
      OctreeBuilder::bytes_with(record_bytes, 1) - OctreeBuilder::bytes_with(record_bytes, 0);
  shares.deep_points =
      std::min(kMaxDeepPoints, shares.batch_records + room / (each + 3 * record_bytes));
  shares.batch_records += std::min(kMaxBatchRecords - shares.batch_records, room / each);
  return shares;
}

/// Collects all records in an octree; finish() writes its nodes as chunks of LAZ.
class CopcWriter final : public PointWriter {
 public:
  CopcWriter(const std::string& path, const PointHeader& header, const WriterOptions& options,
             std::size_t page_nodes)
      : path_(path),
        page_nodes_(page_nodes),
        sink_(path, options.replace, options.stop),
        stop_(options.stop),
        records_(path, header, LasFormats::newer),
        vlr_(laz::Vlr::of(records_.layout().point_format, records_.layout().record_bytes,
                          laz::Vlr::kVariable)),
        shares_(shares_within(options.memory_bytes, options.threads, record_bytes())),
        builder_(path, folder_of(path), record_bytes(), shares_.batch_records, shares_.deep_points,
                 options.threads),
        encoders_(vlr_, shares_.threads,
                  [this](std::span<const std::byte> coded) { write_chunk(coded); }) {
    std::string vlrs;
    append_vlr(vlrs, kCopcUser, kCopcInfo, std::string(kCopcInfoBytes, '\0'));
    append_vlr(vlrs, laz::Vlr::kUserId, laz::Vlr::kRecordId, text_of_bytes(vlr_.serialise()));
    file_.vlrs = 2;
    append_vlrs(vlrs, records_.crs(), records_.layout(), path, file_);
    file_.points_offset = kLas14HeaderBytes + vlrs.size();
    sink_.write(std::string(kLas14HeaderBytes, '\0') + vlrs +
                std::string(sizeof(std::uint64_t), '\0'));
  }

  [[nodiscard]] EncodedPtr encode(const PointBlock& block) const override {
    return records_.encode(block);
  }
  void append(EncodedPtr points) override {
    const std::string_view records = records_.take(std::move(points));
    builder_.add(std::as_bytes(std::span(records)));
    const std::size_t bytes = records_.layout().record_bytes;
    for (std::size_t at = kGpsTimeAt; at < records.size(); at += bytes) {
      const auto time = load_little_endian<double>(records.data() + at);
      first_time_ = std::min(first_time_, time);
      last_time_ = std::max(last_time_, time);
    }
  }

  void finish() override {
    octree_ = cube_around(records_);
    builder_.build(octree_, records_.lattice(),
                   [&](const OctreeNode& node, std::span<const std::byte> records) {
                     if (stop_.stop_requested()) throw Stopped();
                     octree_.nodes.push_back(node);
                     if (!records.empty()) encoders_.encode(records);
                   });
    encoders_.finish();
    std::string position;
    append_little_endian(position, sink_.size());
    sink_.write(laz::write_chunk_table(chunks_, vlr_));
    sink_.write_at(file_.points_offset, position);

    octree_.arrange();
    file_.evlr_offset = sink_.size();
    file_.evlrs = 1;
    constexpr std::uint64_t kEvlrHeaderBytes = 60;
    const std::uint64_t page_at = sink_.size() + kEvlrHeaderBytes;
    const CopcHierarchy hierarchy = write_copc_hierarchy(octree_, page_at, page_nodes_);
    sink_.write(evlr_head(kCopcUser, kCopcHierarchy, hierarchy.bytes.size()));
    assert(sink_.size() == page_at);
    sink_.write(hierarchy.bytes);
    sink_.write_at(kLas14HeaderBytes + kLasVlrHeaderBytes, info(page_at, hierarchy.root_bytes));
    file_.compressed = true;
    sink_.write_at(0, las_header_text(records_, file_));
    sink_.commit();
  }

  std::uint64_t points() const override { return records_.sums().points; }
  bool records_units() const override { return true; }
  double rounding() const override { return records_.sums().rounding; }
  std::uint64_t writing_bytes() const override { return Shares{}.bytes(record_bytes()); }

 private:
  /// Offset of the GPS time in the point formats 6 to 8.
  static constexpr std::size_t kGpsTimeAt = 22;

  [[nodiscard]] std::size_t record_bytes() const { return records_.layout().record_bytes; }

  /// Writes the chunk of the next node that has points.
  void write_chunk(std::span<const std::byte> coded) {
    while (octree_.nodes[written_].points == 0) ++written_;
    OctreeNode& node = octree_.nodes[written_++];
    if (coded.size() > std::numeric_limits<std::int32_t>::max()) {
      throw Error(path_, counted(node.points, "point") +
                             " at one place take more bytes than a node of COPC can have")
          .remedy("leave them out, or write LAZ");
    }
    node.offset = sink_.size();
    node.bytes = coded.size();
    chunks_.push_back({.offset = 0, .bytes = node.bytes, .points = node.points});
    sink_.write(coded);
  }

  [[nodiscard]] std::string info(std::uint64_t page_at, std::uint64_t page_bytes) const {
    std::string info;
    for (const double centre : octree_.centre) append_little_endian(info, centre);
    append_little_endian(info, octree_.half_size);
    append_little_endian(info, octree_.spacing);
    append_little_endian(info, page_at);
    append_little_endian(info, page_bytes);
    const bool timed = first_time_ <= last_time_;
    append_little_endian(info, timed ? first_time_ : 0.0);
    append_little_endian(info, timed ? last_time_ : 0.0);
    info.resize(kCopcInfoBytes, '\0');
    return info;
  }

  std::string path_;
  std::size_t page_nodes_;
  Sink sink_;
  std::stop_token stop_;
  LasRecords records_;
  LasFile file_;
  laz::Vlr vlr_;
  Shares shares_;
  OctreeBuilder builder_;
  Octree octree_;            ///< nodes in the builder's order
  std::size_t written_ = 0;  ///< how many of them have been written
  std::vector<laz::Chunk> chunks_;
  double first_time_ = std::numeric_limits<double>::infinity();
  double last_time_ = -std::numeric_limits<double>::infinity();
  LazEncoders encoders_;  ///< declared last: its callback uses the others
};

}  // namespace

std::unique_ptr<PointWriter> open_copc_writer(const std::string& path, const PointHeader& header,
                                              const WriterOptions& options) {
  return open_paged_copc_writer(path, header, options, kCopcPageNodes);
}

std::unique_ptr<PointWriter> open_paged_copc_writer(const std::string& path,
                                                    const PointHeader& header,
                                                    const WriterOptions& options,
                                                    std::size_t page_nodes) {
  return std::make_unique<CopcWriter>(path, header, options, page_nodes);
}

}  // namespace terrace::stream
