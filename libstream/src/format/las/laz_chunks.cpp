// SPDX-License-Identifier: Apache-2.0
#include "format/las/laz_chunks.hpp"

#include <cstddef>
#include <span>
#include <utility>

#include <fmt/core.h>

#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace {

struct LazFile {
  std::unique_ptr<ByteSource> bytes;
  LazLayout layout;
};

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
    left_ = chunk.points;
    used_ = 0;
  }

  std::size_t read(std::span<std::byte> room) override {
    try {
      const laz::Decoder::Step step = decoder_.step(std::span(coded_).subspan(used_), true, room);
      used_ += step.bytes;
      left_ -= step.points;
      if (step.points == 0) throw laz::Corrupt("the chunk ends before its points", used_);
      if (left_ == 0 && used_ != coded_.size()) {
        throw laz::Corrupt("coded bytes are left over", used_);
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
  std::size_t number_ = 0, used_ = 0;  ///< of the chunk; bytes of it that have been decoded
  std::uint64_t left_ = 0;             ///< points of it that have not been decoded
};

}  // namespace

Error laz_fault(std::string file, std::string cause) {
  return Error(std::move(file), std::move(cause)).remedy("the file is damaged: download it again");
}
Error chunk_fault(std::string file, std::uint64_t chunk, std::uint64_t byte, std::string cause) {
  return laz_fault(std::move(file), std::move(cause))
      .at(fmt::format("chunk {}, byte {}", chunk, byte));
}

RecordParts laz_parts(std::unique_ptr<ByteSource> file, LazLayout layout) {
  RecordParts parts{.record_bytes = layout.vlr.record_length()};
  for (const laz::Chunk& chunk : layout.chunks) {
    parts.parts.push_back({.points = chunk.points, .bytes = chunk.bytes});
  }
  const auto shared = std::make_shared<const LazFile>(LazFile{std::move(file), std::move(layout)});
  parts.make_reader = [shared] { return std::make_unique<LazChunkReader>(shared); };
  return parts;
}

}  // namespace terrace::stream
