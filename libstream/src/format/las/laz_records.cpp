// SPDX-License-Identifier: Apache-2.0
#include "format/las/laz_records.hpp"

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

#include "format/record_parts.hpp"
#include "io/bytes.hpp"
#include "io/peek.hpp"
#include "io/text.hpp"
#include "terrace/stream/byte_source.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/laz.hpp"

namespace terrace::stream {
namespace {

/// The properties of a file's chunks, known before they are read.
struct LazLayout {
  laz::Vlr vlr;
  std::vector<laz::Chunk> chunks{};  ///< empty without a table
  std::uint64_t first = 0;           ///< byte of the first chunk
};

/// Returns an Error with the remedy for a damaged file.
Error laz_fault(std::string file, std::string cause) {
  return Error(std::move(file), std::move(cause)).remedy("the file is damaged: download it again");
}
Error chunk_fault(std::string file, std::uint64_t chunk, std::uint64_t byte, std::string cause) {
  return laz_fault(std::move(file), std::move(cause))
      .at(fmt::format("chunk {}, byte {}", chunk, byte));
}

/// A file and its chunks, shared by the readers of all threads.
struct LazFile {
  std::unique_ptr<ByteSource> bytes;
  LazLayout layout;
};

/// Decodes chunks of a file whose table is known.
class LazChunkReader final : public PartReader {
 public:
  explicit LazChunkReader(std::shared_ptr<const LazFile> file)
      : file_(std::move(file)), decoder_(file_->layout.vlr) {}

  void start(std::size_t part) override {
    number_ = part;
    const laz::Chunk& chunk = file_->layout.chunks[number_];
    coded_.resize(chunk.bytes);
    file_->bytes->read(begin(), coded_);
    decoder_.start(chunk.points);
    remaining_ = chunk.points;
    consumed_ = 0;
  }

  std::size_t read(std::span<std::byte> room) override {
    try {
      const laz::Decoder::Step step =
          decoder_.step(std::span(coded_).subspan(consumed_), true, room);
      consumed_ += step.bytes;
      remaining_ -= step.points;
      if (step.points == 0) throw laz::Corrupt("the chunk ends before its points", consumed_);
      if (remaining_ == 0 && consumed_ != coded_.size()) {
        throw laz::Corrupt("bytes follow the last point of the chunk", consumed_);
      }
      return step.points * file_->layout.vlr.record_length();
    } catch (const laz::Corrupt& error) {
      throw chunk_fault(file_->bytes->name(), number_, begin() + error.offset(), error.what());
    }
  }

 private:
  [[nodiscard]] std::uint64_t begin() const {
    return file_->layout.first + file_->layout.chunks[number_].offset;
  }

  std::shared_ptr<const LazFile> file_;
  laz::Decoder decoder_;
  std::vector<std::byte> coded_;
  std::size_t number_ = 0, consumed_ = 0;  ///< of the chunk; bytes of it that have been decoded
  std::uint64_t remaining_ = 0;            ///< points of it that have not been decoded
};

/// One part per chunk of the layout. A reader holds the coded bytes of one chunk and the models of
/// a decoder.
RecordParts laz_parts(std::unique_ptr<ByteSource> file, LazLayout layout) {
  RecordParts parts{.record_bytes = layout.vlr.record_length()};
  for (const laz::Chunk& chunk : layout.chunks) {
    parts.parts.push_back({.points = chunk.points, .bytes = chunk.bytes});
  }
  const auto shared = std::make_shared<const LazFile>(LazFile{std::move(file), std::move(layout)});
  parts.make_reader = [shared] { return std::make_unique<LazChunkReader>(shared); };
  return parts;
}

/// Size of the chunk table's position, which precedes the first chunk.
constexpr std::size_t kPositionBytes = sizeof(std::int64_t);

laz::Vlr laz_vlr(const LasHeader& header, const std::string& name) {
  for (const LasVlr& record : header.vlrs) {
    if (!record.is(laz::Vlr::kUserId, laz::Vlr::kRecordId)) continue;
    try {
      return laz::Vlr::parse(std::as_bytes(std::span(record.data)), header.point_format,
                             header.record_bytes);
    } catch (const laz::Corrupt& error) {
      throw laz_fault(name, error.what()).at("header");
    }
  }
  throw laz_fault(name, "its points are compressed, but it has no LASzip VLR").at("header");
}

/// Returns the chunks as the file's table lists them; empty if the writer omitted the table.
std::vector<laz::Chunk> read_table(const ByteSource& file, const LazLayout& layout,
                                   std::uint64_t points) {
  constexpr std::size_t kHeadBytes = 8;
  const auto number_at = [&file](std::uint64_t at) {
    char bytes[kPositionBytes];
    file.read(at, std::as_writable_bytes(std::span(bytes)));
    return load_little_endian<std::uint64_t>(bytes);
  };
  const std::uint64_t position_at = layout.first - kPositionBytes;
  if (file.size() < layout.first) {
    throw chunk_fault(file.name(), 0, file.size(), "the file ends before its points");
  }
  std::uint64_t at = number_at(position_at);
  if (at == ~std::uint64_t{0}) at = number_at(file.size() - kPositionBytes);
  if (at == position_at) return {};
  if (at < layout.first || at > file.size() || file.size() - at < kHeadBytes) {
    throw laz_fault(file.name(), "the chunk table is outside the file").at_byte(position_at);
  }
  // An entry takes at most 12 bytes; other data may follow the table.
  const std::uint64_t chunks = number_at(at) >> 32;
  std::vector<std::byte> table(std::min(kHeadBytes + 64 + 12 * chunks, file.size() - at));
  file.read(at, table);
  try {
    return laz::read_chunk_table(table, layout.vlr, points, at - layout.first);
  } catch (const laz::Corrupt& error) {
    throw laz_fault(file.name(), error.what()).at_byte(at + error.offset());
  }
}

/// Reads one chunk after the other through a window of the input.
class SequentialLaz final : public RecordReader {
 public:
  SequentialLaz(Input& input, LazLayout layout, std::uint64_t points, OnDamage on_damage)
      : input_(&input),
        on_damage_(std::move(on_damage)),
        layout_(std::move(layout)),
        record_bytes_(layout_.vlr.record_length()),
        remaining_(points),
        decoder_(layout_.vlr),
        records_(std::max<std::size_t>(1, kPieceBytes / record_bytes_) * record_bytes_) {}

  std::string_view read(std::uint64_t max_records) override {
    if (remaining_ == 0) return {};
    try {
      return read_chunk(max_records);
    } catch (const Error& damage) {
      if (!on_damage_) throw;
      // The start of the next chunk is unknown.
      lost_ = std::exchange(remaining_, 0);
      on_damage_(damage, lost_);
      return {};
    }
  }

  std::uint64_t lost() const override { return lost_; }

  std::uint64_t held_bytes() const override {
    if (layout_.vlr.compressor != laz::Compressor::layered) return 0;
    std::uint64_t largest = 0;
    for (const laz::Chunk& chunk : layout_.chunks) largest = std::max(largest, chunk.bytes);
    return largest;
  }

 private:
  static constexpr std::size_t kPieceBytes = 64u << 10, kWindowBytes = 64u << 10;

  std::string_view read_chunk(std::uint64_t max_records) {
    if (chunk_remaining_ == 0) begin_chunk();
    const auto records = static_cast<std::size_t>(
        std::min<std::uint64_t>({max_records, chunk_remaining_, records_.size() / record_bytes_}));
    const std::span<std::byte> room = std::span(records_).first(records * record_bytes_);
    laz::Decoder::Step step;
    for (std::size_t min_bytes = kWindowBytes; step.points == 0; min_bytes *= 2) {
      step = decode(min_bytes, room);
    }
    chunk_remaining_ -= step.points;
    remaining_ -= step.points;
    if (chunk_remaining_ == 0) end_chunk();
    return {reinterpret_cast<const char*>(records_.data()), step.points * record_bytes_};
  }

  void begin_chunk() {
    begin_ = input_->offset();
    chunk_bytes_.reset();
    chunk_remaining_ = remaining_;
    if (!layout_.chunks.empty()) {
      chunk_remaining_ = layout_.chunks[number_].points;
      chunk_bytes_ = layout_.chunks[number_].bytes;
    } else if (layout_.vlr.compressor == laz::Compressor::layered) {
      const std::size_t bytes = laz::layered_head_size(layout_.vlr);
      const std::string_view window = input_->fill(bytes);
      try {
        const laz::Chunk chunk = laz::layered_chunk(layout_.vlr, std::as_bytes(std::span(window)));
        if (chunk.points == 0 || chunk.points > remaining_) {
          throw laz::Corrupt(fmt::format("the chunk has {}, but {} remain in the file",
                                         counted(chunk.points, "point"), remaining_),
                             0);
        }
        chunk_remaining_ = chunk.points;
        chunk_bytes_ = chunk.bytes;
      } catch (const laz::Corrupt& error) {
        throw fault(error);
      }
    } else if (layout_.vlr.compressor == laz::Compressor::pointwise_chunked) {
      chunk_remaining_ = std::min<std::uint64_t>(remaining_, layout_.vlr.chunk_size);
    }
    if (chunk_remaining_ == 0)
      throw fault(laz::Corrupt("the chunks have fewer points than the header promises", 0));
    decoder_.start(chunk_remaining_);
  }

  /// Decodes from a window of `min_bytes` bytes, or the rest of the chunk if that is smaller.
  laz::Decoder::Step decode(std::size_t min_bytes, std::span<std::byte> room) {
    std::uint64_t window_bytes = min_bytes;
    if (chunk_bytes_)
      window_bytes = std::min(window_bytes, *chunk_bytes_ - (input_->offset() - begin_));
    std::string_view window = input_->fill(static_cast<std::size_t>(window_bytes));
    const bool ended = window.size() < window_bytes;
    if (chunk_bytes_) window = window.substr(0, static_cast<std::size_t>(window_bytes));
    const bool last =
        ended || (chunk_bytes_ && input_->offset() - begin_ + window.size() == *chunk_bytes_);
    try {
      const auto step = decoder_.step(std::as_bytes(std::span(window)), last, room);
      if (step.points == 0 && last) {
        throw laz::Corrupt("the chunk ends before its points",
                           input_->offset() - begin_ + window.size());
      }
      input_->consume(step.bytes);
      return step;
    } catch (const laz::Corrupt& error) {
      throw fault(error);
    }
  }

  void end_chunk() {
    const std::uint64_t consumed = input_->offset() - begin_;
    if (chunk_bytes_ && consumed != *chunk_bytes_) {
      throw fault(laz::Corrupt("bytes follow the last point of the chunk", consumed));
    }
    ++number_;
  }

  [[nodiscard]] Error fault(const laz::Corrupt& error) const {
    return chunk_fault(input_->name(), number_, begin_ + error.offset(), error.what());
  }

  Input* input_;
  OnDamage on_damage_;
  LazLayout layout_;
  std::size_t record_bytes_;
  std::uint64_t remaining_, lost_ = 0;
  laz::Decoder decoder_;
  std::vector<std::byte> records_;
  std::uint64_t number_ = 0, begin_ = 0;      ///< of the chunk
  std::uint64_t chunk_remaining_ = 0;         ///< points left in the chunk
  std::optional<std::uint64_t> chunk_bytes_;  ///< size of the chunk, if known
};

}  // namespace

std::unique_ptr<RecordReader> open_laz_records(Input& input, const std::string& file,
                                               const LasHeader& header,
                                               const SourceOptions& options) {
  LazLayout layout{.vlr = laz_vlr(header, input.name()), .first = header.points_offset};
  if (layout.vlr.compressor == laz::Compressor::none) {
    return std::make_unique<PlainRecords>(input, header.record_bytes, header.points,
                                          options.on_damage);
  }
  const bool has_table = layout.vlr.compressor != laz::Compressor::pointwise;
  if (header.points == 0) {
    return std::make_unique<SequentialLaz>(input, std::move(layout), 0, options.on_damage);
  }
  if (has_table) {
    layout.first += kPositionBytes;
    if (is_seekable(file)) {
      auto bytes = open_file(file);
      try {
        layout.chunks = read_table(*bytes, layout, header.points);
      } catch (const Error& damage) {
        if (!options.on_damage) throw;
        options.on_damage(damage, 0);  // most chunks can be found without the table
      }
      if (!layout.chunks.empty() && (options.threads > 1 || options.on_damage)) {
        if (auto reader = parts_ahead(laz_parts(std::move(bytes), layout), options)) return reader;
      }
    }
    const bool needs_table = layout.vlr.chunk_size == laz::Vlr::kVariable &&
                             layout.vlr.compressor != laz::Compressor::layered;
    if (layout.chunks.empty() && needs_table) {
      throw Error(input.name(),
                  "its chunk table follows the points, so it cannot be read from a pipe")
          .remedy("name the file");
    }
    if (!input.skip(kPositionBytes)) {
      throw chunk_fault(input.name(), 0, input.offset(), "the file ends before its points");
    }
  }
  return std::make_unique<SequentialLaz>(input, std::move(layout), header.points,
                                         options.on_damage);
}

RecordParts copc_node_parts(std::unique_ptr<ByteSource> file, const LasHeader& header,
                            const Octree& octree) {
  LazLayout layout{.vlr = laz_vlr(header, file->name())};
  if (layout.vlr.compressor != laz::Compressor::layered) {
    throw laz_fault(file->name(), "its points are not coded in layers, as COPC requires")
        .at("header");
  }
  for (const OctreeNode& node : octree.nodes) {
    layout.chunks.push_back({.offset = node.offset, .bytes = node.bytes, .points = node.points});
  }
  return laz_parts(std::move(file), std::move(layout));
}

}  // namespace terrace::stream
