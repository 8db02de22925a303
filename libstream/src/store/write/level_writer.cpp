// SPDX-License-Identifier: Apache-2.0
#include "store/write/level_writer.hpp"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include "store/read/index_page.hpp"
#include "store/write/side_by_side.hpp"

namespace terrace::stream::store {
namespace {

/// At most so many of the blocks held back are used to choose how columns are coded.
constexpr std::size_t kTrialBlocks = 8;
/// At most so many attributes are tried as guides.
constexpr std::size_t kMostGuides = 2;
/// At least one in so many differences of a guide begins a line, and as many do not.
constexpr std::uint64_t kLeastShare = 50;

std::string file_name(unsigned level, const char* what) {
  return "level-" + std::to_string(level) + ".0." + what;
}

}  // namespace

LevelWriter::LevelWriter(const std::filesystem::path& folder, Layout layout, unsigned threads)
    : layout_(std::move(layout)),
      data_(folder / file_name(layout_.level, "clusters")),
      index_(folder / file_name(layout_.level, "index")),
      threads_(std::max(1u, threads)),
      encoders_(1) {}

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
    encoders_.front().load(layout_, view);
    encoders_.front().encode(tables_->encoding, tables_->sequence, block.bytes, block.entries,
                             block.ranges);
  }
  write(block);
  return ordinal;
}

std::uint64_t LevelWriter::Trial::bits() const {
  std::uint64_t bits = raw_bits;
  for (const auto& context : counts) bits += entropy_of(context);
  return bits;
}

std::uint64_t LevelWriter::Trial::bits_of_column(const Layout& layout, unsigned column) const {
  std::uint64_t bits = 0;
  for (unsigned c = layout.first_context(column); c < layout.first_context(column + 1); ++c) {
    bits += entropy_of(counts[c]) + open_bits_of(counts[c]);
  }
  return bits;
}

LevelWriter::Trial LevelWriter::count(const Predictor& predictor, const Columns& columns,
                                      std::size_t step) {
  std::vector<Trial> parts(encoders_.size());
  side_by_side(threads_, (held_.size() + step - 1) / step, [&](std::size_t i, std::size_t worker) {
    const ClusteredBlock view = held_[i * step].view();
    encoders_[worker].load(layout_, view);
    parts[worker].raw_bits += encoders_[worker].count(predictor, columns, parts[worker].counts);
  });
  Trial all;
  all.counts.resize(layout_.contexts());
  for (const Trial& part : parts) {
    all.raw_bits += part.raw_bits;
    for (std::size_t c = 0; c < part.counts.size(); ++c) {
      for (unsigned s = 0; s < kSymbols; ++s) all.counts[c][s] += part.counts[c][s];
    }
  }
  return all;
}

bool LevelWriter::possible(ColumnKind kind, unsigned column, const Guide& guide) const {
  if (column == guide.attribute) return kind == ColumnKind::plain || kind == ColumnKind::recent;
  if (along_line(kind) == ColumnKind::beside && !layout_.may_lie_beside(column)) return false;
  return guide.exists() || static_cast<unsigned>(kind) < kUnguidedKinds;
}

LevelWriter::Trial LevelWriter::trial(const Predictor& predictor, bool sequence, const Guide& guide,
                                      ColumnKind kind) {
  std::vector<ColumnKind> kinds(layout_.columns(), kind);
  for (unsigned c = 0; c < kinds.size(); ++c) {
    if (!possible(kind, c, guide)) kinds[c] = ColumnKind::plain;
  }
  return count(predictor, {sequence, guide, kinds},
               (held_.size() + kTrialBlocks - 1) / kTrialBlocks);
}

/// Takes for jumps what lies beyond the sizes of differences that are rarest, if some lie on either
/// side. Points of scanners are microseconds apart, their lines milliseconds.
Guide LevelWriter::find_guide(unsigned attribute) {
  std::array<std::uint64_t, 65> widths{};
  const std::size_t step = (held_.size() + kTrialBlocks - 1) / kTrialBlocks;
  for (std::size_t b = 0; b < held_.size(); b += step) {
    const ClusteredBlock view = held_[b].view();
    encoders_.front().load(layout_, view);
    encoders_.front().count_differences(attribute, widths);
  }
  const std::uint64_t all = std::accumulate(widths.begin() + 1, widths.end(), std::uint64_t{0});
  Guide guide;
  std::uint64_t below = 0, least = UINT64_MAX;
  for (unsigned width = 1; width < 63; ++width) {
    below += widths[width];
    const std::uint64_t near = widths[width] + widths[width + 1];
    const bool divides = below >= all / kLeastShare && all - below >= all / kLeastShare;
    if (!divides || below == 0 || below == all || near >= least) continue;
    least = near;
    guide = {attribute, std::uint64_t{1} << width};
  }
  return guide;
}

/// The kind of each column that takes the fewest bits, with the guide that saves the most; the
/// first time also the order of points.
void LevelWriter::choose_columns(Tables& tables) {
  tables.kinds.assign(layout_.columns(), ColumnKind::plain);
  if (layout_.version == 1) {
    sequence_ = false;
    return;
  }
  std::array<std::optional<Trial>, kColumnKinds> trials;
  std::vector<Guide> guides(1);
  for (unsigned a = 0; a < layout_.attributes.size(); ++a) {
    // Times are doubles or long integers.
    if (size_of(layout_.attributes[a]) < sizeof(double)) continue;
    if (const Guide guide = find_guide(a); guide.exists()) guides.push_back(guide);
    if (guides.size() > kMostGuides) break;
  }
  const std::vector<bool> orders = sequence_      ? std::vector<bool>{*sequence_}
                                   : layout_.grid ? std::vector<bool>{false}
                                                  : std::vector<bool>{false, true};
  std::uint64_t least_bits = UINT64_MAX;
  for (const bool order : orders) {
    for (const Guide& guide : guides) {
      Trial plain = trial(tables.predictor, order, guide, ColumnKind::plain);
      if (plain.bits() >= least_bits) continue;
      least_bits = plain.bits();
      sequence_ = order;
      tables.guide = guide;
      trials[0] = std::move(plain);
    }
  }
  for (unsigned kind = 1; kind < kColumnKinds; ++kind) {
    if (kind >= kUnguidedKinds && !tables.guide.exists()) break;
    trials[kind] = trial(tables.predictor, *sequence_, tables.guide, static_cast<ColumnKind>(kind));
  }
  for (unsigned c = 0; c < tables.kinds.size(); ++c) {
    std::uint64_t least = trials[0]->bits_of_column(layout_, c);
    for (unsigned kind = 1; kind < kColumnKinds && trials[kind]; ++kind) {
      if (!possible(static_cast<ColumnKind>(kind), c, tables.guide)) continue;
      const std::uint64_t bits = trials[kind]->bits_of_column(layout_, c);
      if (bits >= least) continue;
      least = bits;
      tables.kinds[c] = static_cast<ColumnKind>(kind);
    }
  }
}

void LevelWriter::train() {
  encoders_.resize(threads_);
  // Where there are many blocks, a part of them tells as much: others wait for this.
  const bool many = held_.size() == kTrainingBlocks;
  Tables tables;
  if (layout_.grid && layout_.level == 0) {
    PredictorFit sums;
    for (std::size_t b = 0; b < held_.size(); b += many ? 4 : 1) {
      const ClusteredBlock view = held_[b].view();
      encoders_.front().load(layout_, view);
      encoders_.front().fit(sums);
    }
    tables.predictor = sums.fit();
  }
  choose_columns(tables);
  const Columns columns{*sequence_, tables.guide, tables.kinds};
  const Counts counts = count(tables.predictor, columns, many ? 2 : 1).counts;
  for (const auto& context : counts) tables.frequencies.push_back(normalised(context));

  Bytes bytes;
  tables.write(bytes, layout_.version);
  put_varint(table_bytes_, segment_start_);
  put_varint(table_bytes_, bytes.size());
  table_bytes_.insert(table_bytes_.end(), bytes.begin(), bytes.end());
  ++table_count_;
  tables_ = std::make_shared<const SharedTables>(std::move(tables), *sequence_);

  std::vector<PreparedBlock> prepared(held_.size());
  side_by_side(threads_, held_.size(), [&](std::size_t b, std::size_t worker) {
    const ClusteredBlock view = held_[b].view();
    PreparedBlock& block = prepared[b];
    encoders_[worker].load(layout_, view);
    encoders_[worker].encode(tables_->encoding, tables_->sequence, block.bytes, block.entries,
                             block.ranges);
  });
  for (const PreparedBlock& block : prepared) write(block);
  encoders_.resize(1);
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
