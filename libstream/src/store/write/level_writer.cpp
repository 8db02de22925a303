// SPDX-License-Identifier: Apache-2.0
#include "store/write/level_writer.hpp"

#include <array>
#include <utility>

#include "store/read/index_page.hpp"

namespace terrace::stream::store {
namespace {

/// Of those held back, so many at most tell how columns are best coded.
constexpr std::size_t kTrialBlocks = 8;

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
    block.ranges.clear();
    const ClusteredBlock view = block.raw->view();
    encoder_.load(layout_, view);
    encoder_.encode(tables_->encoding, tables_->sequence, block.bytes, block.entries, block.ranges);
  }
  write(block);
  return ordinal;
}

std::uint64_t LevelWriter::Trial::bits() const {
  std::uint64_t bits = raw_bits;
  for (const auto& context : counts) bits += entropy_of(context);
  return bits;
}

std::uint64_t LevelWriter::Trial::bits_of_column(unsigned column) const {
  std::uint64_t bits = 0;
  for (unsigned c = 0; c < context::kPerAttribute; ++c) {
    const auto& counted = counts[context::kAttribute + context::kPerAttribute * column + c];
    bits += entropy_of(counted) + open_bits_of(counted);
  }
  return bits;
}

LevelWriter::Trial LevelWriter::trial(const Predictor& predictor, bool sequence, ColumnKind kind) {
  std::vector<ColumnKind> kinds(layout_.columns(), kind);
  for (unsigned c = 0; c < kinds.size(); ++c) {
    if (kind == ColumnKind::beside && !layout_.may_lie_beside(c)) kinds[c] = ColumnKind::plain;
  }
  Trial trial;
  const std::size_t step = (held_.size() + kTrialBlocks - 1) / kTrialBlocks;
  for (std::size_t b = 0; b < held_.size(); b += step) {
    const ClusteredBlock view = held_[b].view();
    encoder_.load(layout_, view);
    trial.raw_bits += encoder_.count(predictor, {sequence, kinds}, trial.counts);
  }
  trial.counts.resize(layout_.contexts());
  return trial;
}

/// The kind of each column that takes the fewest bits; the first time also the order of points.
std::vector<ColumnKind> LevelWriter::choose_columns(const Predictor& predictor) {
  std::vector<ColumnKind> kinds(layout_.columns(), ColumnKind::plain);
  if (layout_.version == 1) {
    sequence_ = false;
    return kinds;
  }
  if (!sequence_) {
    sequence_ = !layout_.grid && trial(predictor, true, ColumnKind::plain).bits() <
                                     trial(predictor, false, ColumnKind::plain).bits();
  }
  std::array<Trial, kColumnKinds> trials;
  for (unsigned kind = 0; kind < kColumnKinds; ++kind) {
    trials[kind] = trial(predictor, *sequence_, static_cast<ColumnKind>(kind));
  }
  for (unsigned c = 0; c < kinds.size(); ++c) {
    std::uint64_t least = trials[0].bits_of_column(c);
    for (unsigned kind = 1; kind < kColumnKinds; ++kind) {
      const bool possible =
          static_cast<ColumnKind>(kind) != ColumnKind::beside || layout_.may_lie_beside(c);
      const std::uint64_t bits = trials[kind].bits_of_column(c);
      if (!possible || bits >= least) continue;
      least = bits;
      kinds[c] = static_cast<ColumnKind>(kind);
    }
  }
  return kinds;
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
  tables.kinds = choose_columns(tables.predictor);
  Counts counts;
  for (std::size_t b = 0; b < held_.size(); b += many ? 2 : 1) {
    const ClusteredBlock view = held_[b].view();
    encoder_.load(layout_, view);
    encoder_.count(tables.predictor, {*sequence_, tables.kinds}, counts);
  }
  counts.resize(layout_.contexts());
  for (const auto& context : counts) tables.frequencies.push_back(normalised(context));

  Bytes bytes;
  tables.write(bytes);
  put_varint(table_bytes_, segment_start_);
  put_varint(table_bytes_, bytes.size());
  table_bytes_.insert(table_bytes_.end(), bytes.begin(), bytes.end());
  ++table_count_;
  tables_ = std::make_shared<const SharedTables>(std::move(tables), *sequence_);

  PreparedBlock prepared;
  for (const RawBlock& block : held_) {
    const ClusteredBlock view = block.view();
    prepared.bytes.clear();
    prepared.entries.clear();
    prepared.ranges.clear();
    encoder_.load(layout_, view);
    encoder_.encode(tables_->encoding, tables_->sequence, prepared.bytes, prepared.entries,
                    prepared.ranges);
    write(prepared);
  }
  held_.clear();
  held_.shrink_to_fit();
}

void LevelWriter::write(const PreparedBlock& block) {
  data_.write(block.bytes);
  const std::size_t attributes = layout_.version > 1 ? layout_.attributes.size() : 0;
  for (std::size_t i = 0; i < block.entries.size(); ++i) {
    const Entry& entry = block.entries[i];
    page_.push_back(entry);
    const auto ranges = block.ranges.begin() + static_cast<std::ptrdiff_t>(i * attributes);
    page_ranges_.insert(page_ranges_.end(), ranges,
                        ranges + static_cast<std::ptrdiff_t>(attributes));
    data_end_ += entry.bytes;
    points_ += entry.points;
    if (page_.size() == kPageClusters) write_full_page();
  }
}

void LevelWriter::write_full_page() {
  put(directory_, index_.size());
  Bytes bytes;
  write_page(page_,
             layout_.version > 1 ? std::span(layout_.attributes) : std::span<const ScalarType>(),
             page_ranges_, page_offset_, bytes);
  index_.write(bytes);
  page_.clear();
  page_ranges_.clear();
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
