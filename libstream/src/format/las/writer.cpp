// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/core.h>

#include "format/las/header.hpp"
#include "format/las/laz_encoders.hpp"
#include "format/las/record_encoder.hpp"
#include "format/writers.hpp"
#include "io/bytes.hpp"
#include "io/text.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/laz.hpp"
#include "terrace/stream/sink.hpp"

namespace terrace::stream {
namespace {

/// Encodes records as chunks of LAZ and writes these to a sink.
class LazChunks {
 public:
  LazChunks(const laz::Vlr& vlr, unsigned threads, Sink& sink)
      : vlr_(vlr),
        sink_(sink),
        encoders_(vlr, threads, [this](std::span<const std::byte> coded) { write(coded); }) {
    pending_.reserve(vlr_.chunk_size * vlr_.record_length());
  }

  /// Adds records, and writes the chunks that they complete.
  void append(std::string_view records) {
    const std::size_t chunk_bytes = vlr_.chunk_size * vlr_.record_length();
    while (!records.empty()) {
      const std::string_view part = records.substr(0, chunk_bytes - pending_.size());
      pending_ += part;
      records.remove_prefix(part.size());
      if (pending_.size() == chunk_bytes) encode();
    }
  }
  /// Writes the last chunk and the table; returns the table's offset from the first chunk.
  std::uint64_t finish() {
    if (!pending_.empty()) encode();
    encoders_.finish();
    sink_.write(laz::write_chunk_table(chunks_, vlr_));
    return bytes_;
  }

 private:
  void encode() {
    chunks_.push_back({.offset = 0, .bytes = 0, .points = pending_.size() / vlr_.record_length()});
    encoders_.encode(std::as_bytes(std::span(pending_)));
    pending_.clear();
  }
  void write(std::span<const std::byte> coded) {
    chunks_[written_].offset = bytes_;
    chunks_[written_].bytes = coded.size();
    ++written_;
    bytes_ += coded.size();
    sink_.write(coded);
  }

  laz::Vlr vlr_;
  Sink& sink_;
  std::vector<laz::Chunk> chunks_;
  std::size_t written_ = 0;  ///< number of chunks written
  std::string pending_;      ///< records of the next chunk
  std::uint64_t bytes_ = 0;
  LazEncoders encoders_;
};

/// Returns the number of threads, at most options.threads, whose chunks fit into memory: one chunk
/// being filled, and the records and coded bytes of one per thread and one more. Throws: Error if
/// the memory does not suffice for one thread.
unsigned thread_count(const WriterOptions& options, const laz::Vlr& vlr, const std::string& path) {
  const std::uint64_t chunk = vlr.chunk_size * vlr.record_length();
  const std::uint64_t chunks = options.memory_bytes / chunk;
  if (chunks < 2) {
    throw Error(
        path, fmt::format("writing LAZ with {} per point needs {}M of memory, more than it may use",
                          counted(vlr.record_length(), "byte"), (2 * chunk >> 20) + 1))
        .remedy(message("raise {memory_bytes}"));
  }
  const std::uint64_t max_threads = chunks < 5 ? 1 : (chunks - 3) / 2;
  return static_cast<unsigned>(std::min<std::uint64_t>(options.threads, max_threads));
}

/// Writes LAS and LAZ. finish() overwrites the header, which has the sums of all records.
class LasWriter final : public PointWriter {
 public:
  LasWriter(const std::string& path, const PointHeader& header, const WriterOptions& options,
            bool compressed)
      : sink_(path, options.replace, options.stop),
        records_(path, header, LasFormats::all),
        file_{.compressed = compressed} {
    const LasLayout& layout = records_.layout();
    std::string vlrs;
    append_vlrs(vlrs, records_.crs(), layout, path, file_);
    if (compressed) {
      const laz::Vlr vlr = laz::Vlr::of(layout.point_format, layout.record_bytes);
      const std::vector<std::byte> data = vlr.serialise();
      append_vlr(vlrs, laz::Vlr::kUserId, laz::Vlr::kRecordId,
                 {reinterpret_cast<const char*>(data.data()), data.size()});
      ++file_.vlrs;
      chunks_.emplace(vlr, thread_count(options, vlr, path), sink_);
    }
    file_.points_offset = kLas14HeaderBytes + vlrs.size();
    sink_.write(std::string(kLas14HeaderBytes, '\0') + vlrs);
    if (compressed) sink_.write(std::string(sizeof(std::uint64_t), '\0'));
  }

  [[nodiscard]] EncodedPtr encode(const PointBlock& block) const override {
    return records_.encode(block);
  }
  void append(EncodedPtr points) override {
    const std::string_view records = records_.take(std::move(points));
    if (chunks_) {
      chunks_->append(records);
    } else {
      sink_.write(records);
    }
  }

  void finish() override {
    if (chunks_) {
      const std::uint64_t first = file_.points_offset + sizeof(std::uint64_t);
      std::string position;
      append_little_endian(position, first + chunks_->finish());
      sink_.write_at(file_.points_offset, position);
    }
    sink_.write_at(0, las_header_text(records_, file_));
    sink_.commit();
  }

  std::uint64_t points() const override { return records_.sums().points; }
  bool records_units() const override { return true; }
  double rounding() const override { return records_.sums().rounding; }

 private:
  Sink sink_;
  LasRecords records_;
  LasFile file_;
  std::optional<LazChunks> chunks_;  ///< only for LAZ
};

}  // namespace

std::unique_ptr<PointWriter> open_las_writer(const std::string& path, const PointHeader& header,
                                             const WriterOptions& options) {
  return std::make_unique<LasWriter>(path, header, options, /*compressed=*/false);
}

std::unique_ptr<PointWriter> open_laz_writer(const std::string& path, const PointHeader& header,
                                             const WriterOptions& options) {
  return std::make_unique<LasWriter>(path, header, options, /*compressed=*/true);
}

}  // namespace terrace::stream
