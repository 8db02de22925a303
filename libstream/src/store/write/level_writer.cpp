// SPDX-License-Identifier: Apache-2.0
#include "store/write/level_writer.hpp"

#include <utility>

#include "store/read/index_page.hpp"

namespace terrace::stream::store {
namespace {

std::string file_name(unsigned level, const char* what) {
  return "level-" + std::to_string(level) + ".0." + what;
}

}  // namespace

LevelWriter::LevelWriter(const std::filesystem::path& folder, Layout layout)
    : layout_(std::move(layout)),
      data_(folder / file_name(layout_.level, "clusters")),
      index_(folder / file_name(layout_.level, "index")) {}

std::uint64_t LevelWriter::append(PreparedBlock block, bool root) {
  if (at_segment_start()) {
    if (!held_.empty()) train();
    tables_.reset();
    segment_start_ = clusters_;
  }
  ++blocks_;
  const std::uint64_t ordinal = clusters_;
  clusters_ += block.clusters;

  if (block.raw == nullptr && block.tables != tables_) {
    // Encoded ahead of its turn, with tables of the segment before: undone.
    block.raw =
        std::make_unique<RawBlock>(decoded_block(layout_, block.tables->tables, block.bytes,
                                                 block.entries, std::move(block.summaries), root));
  }
  if (tables_ == nullptr) {
    held_.push_back(std::move(*block.raw));
    if (held_.size() == kTrainingBlocks) train();
    return ordinal;
  }
  if (block.raw != nullptr) {
    block.bytes.clear();
    block.entries.clear();
    const ClusteredBlock view = block.raw->view();
    encoder_.load(layout_, view);
    encoder_.encode(tables_->encoding, block.bytes, block.entries);
  }
  write(block);
  return ordinal;
}

void LevelWriter::train() {
  // Where there are many blocks, a part of them tells as much: others wait for this.
  const bool many = held_.size() == kTrainingBlocks;
  Tables tables;
  if (layout_.grid && layout_.level == 0) {
    PredictorFit sums;
    for (std::size_t b = 0; b < held_.size(); b += many ? 4 : 1) {
      const ClusteredBlock view = held_[b].view();
      encoder_.load(layout_, view);
      encoder_.fit(sums);
    }
    tables.predictor = sums.fit();
  }
  Counts counts;
  for (std::size_t b = 0; b < held_.size(); b += many ? 2 : 1) {
    const ClusteredBlock view = held_[b].view();
    encoder_.load(layout_, view);
    encoder_.count(tables.predictor, counts);
  }
  counts.resize(layout_.contexts());
  for (const auto& context : counts) tables.frequencies.push_back(normalised(context));

  Bytes bytes;
  tables.write(bytes);
  put_varint(table_bytes_, segment_start_);
  put_varint(table_bytes_, bytes.size());
  table_bytes_.insert(table_bytes_.end(), bytes.begin(), bytes.end());
  ++table_count_;
  tables_ = std::make_shared<const SharedTables>(std::move(tables));

  PreparedBlock prepared;
  for (const RawBlock& block : held_) {
    const ClusteredBlock view = block.view();
    prepared.bytes.clear();
    prepared.entries.clear();
    encoder_.load(layout_, view);
    encoder_.encode(tables_->encoding, prepared.bytes, prepared.entries);
    write(prepared);
  }
  held_.clear();
  held_.shrink_to_fit();
}

void LevelWriter::write(const PreparedBlock& block) {
  data_.write(block.bytes);
  for (const Entry& entry : block.entries) {
    page_.push_back(entry);
    data_end_ += entry.bytes;
    points_ += entry.points;
    if (page_.size() == kPageClusters) write_full_page();
  }
}

void LevelWriter::write_full_page() {
  put(directory_, index_.size());
  Bytes bytes;
  write_page(page_, page_offset_, bytes);
  index_.write(bytes);
  page_.clear();
  page_offset_ = data_end_;
}

LevelEntry LevelWriter::finish(bool root) {
  if (!held_.empty()) train();
  if (!page_.empty()) write_full_page();
  put(directory_, index_.size());
  put(directory_, table_count_);
  directory_.insert(directory_.end(), table_bytes_.begin(), table_bytes_.end());
  put(directory_, crc32(directory_));
  index_.write(directory_);
  data_.finish();
  index_.finish();

  LevelEntry entry;
  entry.clusters = clusters_;
  entry.members = root ? points_ : points_ - clusters_;
  entry.data = {data_.path().filename().string(), data_.size(), data_.checksum()};
  entry.index = {index_.path().filename().string(), index_.size(), index_.checksum()};
  entry.directory_bytes = directory_.size();
  return entry;
}

}  // namespace terrace::stream::store
