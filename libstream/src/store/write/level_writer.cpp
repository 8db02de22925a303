// SPDX-License-Identifier: Apache-2.0
#include "store/write/level_writer.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <numeric>
#include <utility>

#include <fcntl.h>
#include <fmt/core.h>
#include <terrace/base/thread_team.hpp>
#include <unistd.h>

#include "io/file_size_signal.hpp"
#include "io/output_placement.hpp"
#include "store/read/directory.hpp"
#include "store/read/index_page.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream::store {
namespace {

/// Bytes that OutputFile buffers.
constexpr std::size_t kBufferSize = 1u << 18;

/// Returns an error with the cause and the meaning of errno.
Error errno_error(const std::filesystem::path& path, const char* cause) {
  const int number = errno;
  return system_error(path.string(), cause, number, remedy_for(number));
}

/// Blocks up to this size in bytes are deduplicated against earlier blocks with the same tables.
constexpr std::size_t kMaxSharedBytes = 1024;
/// Maximum number of training blocks that are used to choose how columns are coded. Rasters have
/// columns only above level 0, where the choice matters little.
constexpr std::size_t kTrialBlocks = 8, kRasterTrialBlocks = 2;
/// The first blocks decide the point order of the whole level. Keeping the input order must save
/// more than 1/kMinOrderGainDivisor of the bits, because the sizes of the first blocks are only an
/// estimate.
constexpr std::uint64_t kMinOrderGainDivisor = 64;
/// Number of 64-bit attributes, from the first, that are tried as guides (see Guide).
constexpr std::size_t kMaxGuides = 2;
/// A threshold separates scan lines only if at least 1/kMinSideDivisor of the differences are on
/// either side of it.
constexpr std::uint64_t kMinSideDivisor = 50;

template <class Box>
void put_box(Bytes& out, const Box& box) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    put(out, box.low[axis]);
    put(out, box.high[axis]);
  }
}

std::string file_name(unsigned level, const char* kind) {
  return fmt::format("level-{}.0.{}", level, kind);
}

void add_to(Counts& total, const Counts& counts) {
  total.resize(std::max(total.size(), counts.size()));
  for (std::size_t c = 0; c < counts.size(); ++c) {
    for (unsigned s = 0; s < kSymbols; ++s) total[c][s] += counts[c][s];
  }
}

}  // namespace

Descriptor& Descriptor::operator=(Descriptor&& other) noexcept {
  if (this != &other) {
    if (fd_ >= 0) ::close(fd_);
    fd_ = other.release();
  }
  return *this;
}

Descriptor::~Descriptor() {
  if (fd_ >= 0) ::close(fd_);
}

OutputFile::OutputFile(std::filesystem::path path, std::filesystem::path shown)
    : path_(std::move(path)), shown_(std::move(shown)) {
  fd_ = Descriptor(::open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
  if (!fd_.open()) throw errno_error(shown_, "cannot be created");
  buffer_.reserve(kBufferSize);
}

void OutputFile::write(ByteView bytes) {
  checksum_ = crc32(checksum_, bytes.data(), bytes.size());
  size_ += bytes.size();
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
  if (buffer_.size() >= kBufferSize) flush();
}

void OutputFile::flush() {
  const FileSizeSignalBlock no_signal;
  const std::uint8_t* next = buffer_.data();
  std::size_t remaining = buffer_.size();
  while (remaining > 0) {
    const ssize_t written = ::write(fd_.get(), next, remaining);
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) throw errno_error(shown_, "cannot be written");
    next += written;
    remaining -= static_cast<std::size_t>(written);
  }
#ifdef SYNC_FILE_RANGE_WRITE
  // Starts writing to disk while further blocks are encoded, so that finish() waits less. finish()
  // reports errors.
  static_cast<void>(::sync_file_range(fd_.get(), static_cast<off_t>(flushed_),
                                      static_cast<off_t>(buffer_.size()), SYNC_FILE_RANGE_WRITE));
#endif
  flushed_ += buffer_.size();
  buffer_.clear();
}

void OutputFile::finish() {
  flush();
  const FileSizeSignalBlock no_signal;
  if (::fsync(fd_.get()) != 0) throw errno_error(shown_, "cannot be synced");
  if (::close(fd_.release()) != 0) throw errno_error(shown_, "cannot be closed");
}

LevelWriter::LevelWriter(const std::filesystem::path& folder, const std::filesystem::path& shown,
                         Layout layout, base::ThreadTeam& team, std::uint64_t first)
    : layout_(std::move(layout)),
      first_(first),
      data_(folder / file_name(layout_.level, "clusters"), shown),
      index_(folder / file_name(layout_.level, "index"), shown),
      team_(team),
      encoders_(1) {}

std::uint64_t LevelWriter::append(PreparedBlock block, bool root) {
  if (needs_new_tables()) {
    if (!training_blocks_.empty()) train();
    tables_.reset();
    small_blocks_.clear();
    tables_start_ = clusters_;
  }
  ++blocks_;
  const std::uint64_t first_cluster = first_ + clusters_;
  clusters_ += block.clusters;

  if (block.raw == nullptr && block.tables != tables_) {
    // Encoded with the previous tables: decode it.
    block.raw =
        std::make_unique<RawBlock>(decoded_block(layout_, block.tables->tables, block.bytes,
                                                 block.entries, std::move(block.summaries), root));
  }
  if (tables_ == nullptr) {
    training_blocks_.push_back(std::move(*block.raw));
    if (training_blocks_.size() == kTrainingBlocks) train();
    return first_cluster;
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
  return first_cluster;
}

std::uint64_t LevelWriter::Trial::bits() const {
  std::uint64_t bits = raw_bits;
  for (const auto& context : counts) bits += entropy_of(context);
  return bits;
}

std::uint64_t LevelWriter::bits_of_column(const Counts& counts, unsigned column) const {
  std::uint64_t bits = 0;
  for (unsigned c = layout_.first_context(column); c < layout_.first_context(column + 1); ++c) {
    bits += entropy_of(counts[c]) + open_bits_of(counts[c]);
  }
  return bits;
}

template <class Visit>
void LevelWriter::for_every(std::size_t step, Visit&& visit) {
  team_.run((training_blocks_.size() + step - 1) / step, [&](std::size_t i, std::size_t worker) {
    const ClusteredBlock view = training_blocks_[i * step].view();
    encoders_[worker].load(layout_, view);
    visit(encoders_[worker], worker);
  });
}

std::vector<LevelWriter::Trial> LevelWriter::count_symbols(const Predictor& predictor,
                                                           std::span<const Columns> columns,
                                                           std::size_t step) {
  std::vector<std::vector<Trial>> parts(encoders_.size(), std::vector<Trial>(columns.size()));
  for_every(step, [&](BlockEncoder& encoder, std::size_t worker) {
    for (std::size_t i = 0; i < columns.size(); ++i) {
      Trial& part = parts[worker][i];
      part.raw_bits += encoder.count(predictor, columns[i], part.counts);
    }
  });
  std::vector<Trial> sums(columns.size());
  for (const std::vector<Trial>& part : parts) {
    for (std::size_t i = 0; i < sums.size(); ++i) {
      add_to(sums[i].counts, part[i].counts);
      sums[i].raw_bits += part[i].raw_bits;
    }
  }
  return sums;
}

/// Returns the step between the blocks that are used to choose how columns are coded.
std::size_t LevelWriter::trial_step() const {
  const std::size_t count_limit =
      layout_.grid && layout_.level > 0 ? kRasterTrialBlocks : kTrialBlocks;
  return (training_blocks_.size() + count_limit - 1) / count_limit;
}

bool LevelWriter::is_allowed(ColumnKind kind, unsigned column, const Guide& guide) const {
  if (column == guide.attribute) return kind == ColumnKind::plain || kind == ColumnKind::recent;
  if (along_line(kind) == ColumnKind::preceding && !layout_.may_use_preceding(column)) return false;
  return guide.exists() || static_cast<unsigned>(kind) < kUnguidedKinds;
}

/// Returns attributes that may be guides. Candidates are 64-bit attributes, such as GPS times.
/// Points of a scan line are microseconds apart, lines are milliseconds apart. So the threshold is
/// the least frequent size of difference, if enough differences are on either side.
std::vector<Guide> LevelWriter::find_guides() {
  std::vector<unsigned> attributes;
  for (unsigned a = 0; a < layout_.attributes.size() && attributes.size() < kMaxGuides; ++a) {
    if (size_of(layout_.attributes[a]) == sizeof(double)) attributes.push_back(a);
  }
  constexpr unsigned kWidths = 65;  // a difference of 64 bits has 0 to 64 significant bits
  std::vector<std::array<std::uint64_t, kWidths>> widths(attributes.size());
  const std::size_t step = (training_blocks_.size() + kTrialBlocks - 1) / kTrialBlocks;
  for (std::size_t b = 0; b < training_blocks_.size() && !attributes.empty(); b += step) {
    const ClusteredBlock view = training_blocks_[b].view();
    encoders_.front().load(layout_, view);
    for (std::size_t i = 0; i < attributes.size(); ++i) {
      encoders_.front().count_differences(attributes[i], widths[i]);
    }
  }
  std::vector<Guide> guides;
  for (std::size_t i = 0; i < attributes.size(); ++i) {
    const std::uint64_t total =
        std::accumulate(widths[i].begin() + 1, widths[i].end(), std::uint64_t{0});
    std::uint64_t below = 0, minimum = UINT64_MAX;
    Guide guide;
    // Thresholds 2^width, with widths on either side.
    for (unsigned width = 1; width + 2 < kWidths; ++width) {
      below += widths[i][width];
      const std::uint64_t at_threshold = widths[i][width] + widths[i][width + 1];
      const std::uint64_t min_side = std::max<std::uint64_t>(total / kMinSideDivisor, 1);
      const bool separates = below >= min_side && total - below >= min_side;
      if (!separates || at_threshold >= minimum) continue;
      minimum = at_threshold;
      guide = {attributes[i], std::uint64_t{1} << width};
    }
    if (guide.exists()) guides.push_back(guide);
  }
  return guides;
}

/// Chooses the kind of each column that takes the fewest bits, and the guide that saves the most.
/// The first call also fixes the point order of the level.
void LevelWriter::choose_columns(Tables& tables) {
  tables.kinds.assign(layout_.columns(), ColumnKind::plain);
  if (layout_.attributes.empty() && !layout_.has_point_columns()) {
    sequence_ = false;
    return;
  }
  std::vector<Guide> guides = find_guides();
  guides.emplace(guides.begin());  // no guide
  std::vector<Columns> choices;
  for (const bool sequence : {false, true}) {
    const bool is_fixed = sequence_ || !layout_.has_point_columns();
    if (is_fixed && sequence != sequence_.value_or(false)) continue;
    for (const Guide& guide : guides) choices.push_back({sequence, guide, tables.kinds});
  }
  const std::vector<Trial> trials = count_symbols(tables.predictor, choices, trial_step());
  std::uint64_t minimum = UINT64_MAX;
  std::size_t best = 0;
  for (std::size_t i = 0; i < choices.size(); ++i) {
    std::uint64_t bits = trials[i].bits();
    if (choices[i].sequence) bits += bits / kMinOrderGainDivisor;
    if (bits >= minimum) continue;
    minimum = bits;
    best = i;
  }
  sequence_ = choices[best].sequence;
  tables.guide = choices[best].guide;
  choose_kinds(tables, trials[best].counts);
}

/// Chooses the kind of each column. plain_counts: the counts with all columns coded as
/// ColumnKind::plain.
void LevelWriter::choose_kinds(Tables& tables, const Counts& plain_counts) {
  std::vector<std::vector<ColumnKind>> allowed_kinds(layout_.columns());
  for (unsigned c = 0; c < layout_.columns(); ++c) {
    for (unsigned kind = 1; kind < kColumnKinds; ++kind) {
      if (is_allowed(static_cast<ColumnKind>(kind), c, tables.guide)) {
        allowed_kinds[c].push_back(static_cast<ColumnKind>(kind));
      }
    }
  }
  std::vector<KindCounts> parts(encoders_.size(), {allowed_kinds, {}});
  for_every(trial_step(), [&](BlockEncoder& encoder, std::size_t worker) {
    encoder.count_kinds(tables.predictor, *sequence_, tables.guide, parts[worker]);
  });
  std::array<Counts, kColumnKinds> counts;
  for (unsigned kind = 1; kind < kColumnKinds; ++kind) {
    for (const KindCounts& part : parts) add_to(counts[kind], part.counts[kind]);
  }
  for (unsigned c = 0; c < layout_.columns(); ++c) {
    std::uint64_t minimum = bits_of_column(plain_counts, c);
    for (const ColumnKind kind : allowed_kinds[c]) {
      const std::uint64_t bits = bits_of_column(counts[static_cast<std::size_t>(kind)], c);
      if (bits >= minimum) continue;
      minimum = bits;
      tables.kinds[c] = kind;
    }
  }
}

void LevelWriter::train() {
  encoders_.resize(team_.threads());
  // Count only some of many blocks, because other threads wait.
  const bool is_full_set = training_blocks_.size() == kTrainingBlocks;
  const std::size_t fit_step = is_full_set ? 4 : 1, count_step = is_full_set ? 2 : 1;
  Tables tables;
  if (layout_.grid && layout_.level == 0) {
    PredictorFit sums;
    for (std::size_t b = 0; b < training_blocks_.size(); b += fit_step) {
      const ClusteredBlock view = training_blocks_[b].view();
      encoders_.front().load(layout_, view);
      encoders_.front().fit(sums);
    }
    tables.predictor = sums.fit();
  }
  choose_columns(tables);
  const Columns columns{*sequence_, tables.guide, tables.kinds};
  Counts counts = std::move(count_symbols(tables.predictor, {&columns, 1}, count_step)[0].counts);
  // A symbol costs two bytes in the table, too much for one occurrence unless further blocks use
  // the table.
  const std::uint32_t minimum = is_full_set ? 1 : 2;
  for (const auto& context : counts) tables.frequencies.push_back(normalised(context, minimum));

  std::vector<PreparedBlock> prepared(training_blocks_.size());
  const EncodingTables encoding(tables);
  team_.run(training_blocks_.size(), [&](std::size_t b, std::size_t worker) {
    const ClusteredBlock view = training_blocks_[b].view();
    PreparedBlock& block = prepared[b];
    encoders_[worker].load(layout_, view);
    encoders_[worker].encode(encoding, *sequence_, block.bytes, block.entries, block.ranges);
  });
  count_index(prepared, counts);
  for (std::size_t c = layout_.index_context(); c < counts.size(); ++c) {
    tables.frequencies[c] = normalised(counts[c], minimum);
  }

  sets_.push_back({.first = tables_start_, .bytes = {}});
  tables.write(sets_.back().bytes);
  tables_ = std::make_shared<const SharedTables>(std::move(tables), *sequence_);
  for (const PreparedBlock& block : prepared) write(block);
  encoders_.resize(1);
  training_blocks_.clear();
  training_blocks_.shrink_to_fit();
}

/// Counts the symbols of the index as if the first block began a page.
void LevelWriter::count_index(std::span<const PreparedBlock> blocks, Counts& counts) const {
  std::vector<Entry> entries;
  std::vector<KeyRange> ranges;
  const std::size_t attributes = layout_.attributes.size();
  const auto count_page = [&] {
    PageContent{0, PageColumns(entries), RangeColumns(ranges, layout_.attributes)}.count(layout_,
                                                                                         counts);
    entries.clear();
    ranges.clear();
  };
  for (const PreparedBlock& block : blocks) {
    for (std::size_t i = 0; i < block.entries.size(); ++i) {
      entries.push_back(block.entries[i]);
      for (std::size_t a = 0; a < attributes; ++a)
        ranges.push_back(block.ranges[i * attributes + a]);
      if (entries.size() == layout_.page_clusters()) count_page();
    }
  }
  if (!entries.empty()) count_page();
}

void LevelWriter::write(const PreparedBlock& block) {
  std::uint64_t offset = data_.size();
  bool is_shared = false;
  if (layout_.small() && block.bytes.size() <= kMaxSharedBytes) {
    const auto [entry, inserted] =
        small_blocks_.try_emplace(std::string(block.bytes.begin(), block.bytes.end()), offset);
    offset = entry->second;
    is_shared = !inserted;
  }
  if (!is_shared) data_.write(block.bytes);
  const std::size_t attributes = layout_.attributes.size();
  for (std::size_t i = 0; i < block.entries.size(); ++i) {
    if (page_.empty()) {
      page_tables_ = tables_;
      page_offset_ = last_end_ = offset;
    }
    Entry entry = block.entries[i];
    entry.jump = static_cast<std::int64_t>(offset - last_end_);
    page_.push_back(entry);
    last_end_ = offset += entry.bytes;
    const auto ranges = block.ranges.begin() + static_cast<std::ptrdiff_t>(i * attributes);
    page_ranges_.insert(page_ranges_.end(), ranges,
                        ranges + static_cast<std::ptrdiff_t>(attributes));
    points_ += entry.points;
    if (page_.size() == layout_.page_clusters()) write_page();
  }
}

void LevelWriter::write_page() {
  Box3 box;
  for (const Entry& entry : page_) {
    if (entry.points > 0) box.include(record_of(entry, layout_.level, 0, false).summary.box);
  }
  Bytes bytes;
  PageContent{page_offset_, PageColumns(page_), RangeColumns(page_ranges_, layout_.attributes)}
      .write(layout_, page_tables_->encoding, bytes);
  index_.write(bytes);
  pages_.push_back({bytes.size(), box});
  page_.clear();
  page_ranges_.clear();
}

std::uint64_t LevelWriter::write_directory(const Box3& bounds) {
  Bytes directory;
  for (std::size_t first = 0; first < pages_.size(); first += kChapterPages) {
    const auto pages = std::span(pages_).subspan(
        first, std::min<std::size_t>(kChapterPages, pages_.size() - first));
    Box3 chapter_bounds;
    std::uint64_t page_bytes = 0;
    for (const PageAt& page : pages) {
      if (!page.box.empty()) chapter_bounds.include(page.box);
      page_bytes += page.bytes;
    }
    const ChapterBox chapter =
        chapter_bounds.empty() ? ChapterBox() : ChapterBox::around(chapter_bounds, bounds);
    Bytes chapter_bytes;
    for (const PageAt& page : pages) {
      put_varint(chapter_bytes, page.bytes);
      put_box(chapter_bytes,
              page.box.empty() ? PageBox() : PageBox::around(page.box, chapter.in(bounds)));
    }
    put(chapter_bytes, crc32(chapter_bytes));
    index_.write(chapter_bytes);
    put_varint(directory, page_bytes);
    put_varint(directory, chapter_bytes.size());
    put_box(directory, chapter);
  }
  put_varint(directory, sets_.size());
  for (Set& set : sets_) {
    put_varint(directory, set.first);
    put_varint(directory, set.bytes.size());
    put(set.bytes, crc32(set.bytes));
    index_.write(set.bytes);
  }
  put(directory, crc32(directory));
  index_.write(directory);
  return directory.size();
}

LevelWriter::Written LevelWriter::finish(bool root, const Box3& bounds) {
  if (!training_blocks_.empty()) train();
  if (!page_.empty()) write_page();
  const std::uint64_t directory_bytes = write_directory(bounds);
  data_.finish();
  index_.finish();

  Written written;
  written.members = root ? points_ : points_ - clusters_;
  SegmentEntry& segment = written.segment;
  segment.clusters = clusters_;
  segment.data = {data_.path().filename().string(), data_.size(), data_.checksum()};
  segment.index = {index_.path().filename().string(), index_.size(), index_.checksum()};
  segment.directory_bytes = directory_bytes;
  segment.bounds = bounds;
  segment.base.assign(layout_.level, 0);
  return written;
}

std::string segment_file_name(unsigned level, const SegmentEntry& segment, const char* kind) {
  return fmt::format("level-{}.{:08x}{:08x}.{}", level, segment.data.checksum,
                     segment.index.checksum, kind);
}

}  // namespace terrace::stream::store
