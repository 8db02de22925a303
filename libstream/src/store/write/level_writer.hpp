// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <terrace/base/thread_team.hpp>

#include "store/codec/bytes.hpp"
#include "store/manifest.hpp"
#include "store/write/block_encoder.hpp"
#include "store/write/raw_block.hpp"

namespace terrace::stream::store {

/// A file descriptor that is closed automatically.
class Descriptor {
 public:
  Descriptor() = default;
  explicit Descriptor(int fd) : fd_(fd) {}
  Descriptor(Descriptor&& other) noexcept : fd_(other.release()) {}
  Descriptor& operator=(Descriptor&& other) noexcept;
  ~Descriptor();

  [[nodiscard]] int get() const { return fd_; }
  [[nodiscard]] bool open() const { return fd_ >= 0; }
  int release() {
    const int fd = fd_;
    fd_ = -1;
    return fd;
  }

 private:
  int fd_ = -1;
};

/// Writes a new file sequentially through a buffer, and computes its CRC-32. Every failed write
/// throws an Error, including one that is reported only by fsync or close.
class OutputFile {
 public:
  /// shown: the name of the output in messages, instead of its temporary files.
  OutputFile(std::filesystem::path path, std::filesystem::path shown);

  void write(ByteView bytes);
  /// Writes the buffer, syncs and closes.
  void finish();
  [[nodiscard]] std::uint64_t size() const { return size_; }
  [[nodiscard]] std::uint32_t checksum() const { return checksum_; }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  void flush();

  std::filesystem::path path_, shown_;
  Descriptor fd_;
  Bytes buffer_;
  std::uint64_t size_ = 0, flushed_ = 0;
  std::uint32_t checksum_ = 0;
};

/// Number of consecutive blocks of a level that share tables, and of those, from the first, that
/// are held until the tables are made from them.
inline constexpr std::uint64_t kBlocksPerTables = 1024;
inline constexpr std::size_t kTrainingBlocks = 64;

/// Tables for encoding and decoding. A block that was encoded with earlier ones must be decoded.
struct SharedTables {
  SharedTables(Tables trained, bool keeps_order)
      : tables(std::move(trained)), encoding(tables), sequence(keeps_order) {}
  Tables tables;
  EncodingTables encoding;
  bool sequence;  ///< see Columns
};
using SharedTablesPtr = std::shared_ptr<const SharedTables>;

/// A block to be written to a level: raw as long as there are no tables, then encoded.
struct PreparedBlock {
  std::size_t clusters = 0;
  std::unique_ptr<RawBlock> raw;
  // If encoded:
  SharedTablesPtr tables;
  Bytes bytes;
  std::vector<Entry> entries;
  std::vector<KeyRange> ranges;
  std::vector<ClusterSummary> summaries;
};

/// Returns the name of a file of a segment, named after its contents. kind: "clusters" or "index".
std::string segment_file_name(unsigned level, const SegmentEntry& segment, const char* kind);

/// Writes the two files of a segment. Not thread-safe; training uses the team, because all further
/// blocks wait for it. The bytes depend only on the blocks and their order, not on which of them
/// were passed encoded.
class LevelWriter {
 public:
  /// shown: the name of the store in messages. first: the number of the level's clusters in other
  /// segments, which come before this one.
  LevelWriter(const std::filesystem::path& folder, const std::filesystem::path& shown,
              Layout layout, base::ThreadTeam& team, std::uint64_t first = 0);

  /// Returns the tables to encode blocks with now; null if there are none.
  [[nodiscard]] const SharedTablesPtr& tables() const { return tables_; }
  [[nodiscard]] const Layout& layout() const { return layout_; }
  [[nodiscard]] std::uint64_t clusters() const { return clusters_; }

  /// Appends a block. Returns the ordinal in the level of its first cluster.
  std::uint64_t append(PreparedBlock block, bool root);
  struct Written {
    std::uint64_t members = 0;  ///< points of all clusters without representatives
    SegmentEntry segment;
  };
  /// Writes the remaining blocks, the directory and the tables; syncs and closes the files. bounds:
  /// the store's.
  Written finish(bool root, const Box3& bounds);

  /// Whether the next block gets new tables.
  [[nodiscard]] bool needs_new_tables() const { return blocks_ % kBlocksPerTables == 0; }

 private:
  /// The counts of the training blocks, as if encoded.
  struct Trial {
    Counts counts;
    std::uint64_t raw_bits = 0;

    [[nodiscard]] std::uint64_t bits() const;
  };
  /// Calls visit(encoder, worker) for every step-th training block.
  template <class Visit>
  void for_every(std::size_t step, Visit&& visit);
  /// Counts the symbols of every step-th training block, with each of these columns.
  std::vector<Trial> count_symbols(const Predictor& predictor, std::span<const Columns> columns,
                                   std::size_t step);
  [[nodiscard]] std::size_t trial_step() const;
  [[nodiscard]] std::uint64_t bits_of_column(const Counts& counts, unsigned column) const;
  void choose_kinds(Tables& tables, const Counts& plain_counts);
  [[nodiscard]] bool is_allowed(ColumnKind kind, unsigned column, const Guide& guide) const;
  std::vector<Guide> find_guides();
  void choose_columns(Tables& tables);
  void train();
  void count_index(std::span<const PreparedBlock> blocks, Counts& counts) const;
  void write(const PreparedBlock& block);
  void write_page();
  /// Writes the contents of the chapters, the tables and the directory. Returns the size of the
  /// directory in bytes.
  std::uint64_t write_directory(const Box3& bounds);

  Layout layout_;
  std::uint64_t first_;
  OutputFile data_, index_;
  std::vector<RawBlock> training_blocks_;
  /// Whether points are coded in the order in which they were passed. One choice for the whole
  /// level, because a block that was encoded with the previous tables has lost any other order.
  std::optional<bool> sequence_;
  SharedTablesPtr tables_;
  base::ThreadTeam& team_;
  std::vector<BlockEncoder> encoders_;  ///< one; in training one per thread
  std::uint64_t blocks_ = 0, clusters_ = 0, points_ = 0;
  std::uint64_t tables_start_ = 0;  ///< number of the first cluster that uses the tables
  SharedTablesPtr page_tables_;     ///< tables of the page's first cluster
  std::vector<Entry> page_;
  std::vector<KeyRange> page_ranges_;
  struct PageAt {
    std::uint64_t bytes = 0;
    Box3 box;
  };
  std::vector<PageAt> pages_;
  std::uint64_t page_offset_ = 0;  ///< offset of the page's first cluster in the data
  std::uint64_t last_end_ = 0;     ///< end of the last cluster in the data
  /// Offsets in the data of the blocks of few bytes that share tables. Blocks of still water, for
  /// example, are equal.
  std::map<std::string, std::uint64_t> small_blocks_;
  struct Set {
    std::uint64_t first = 0;  ///< number of the first cluster that uses it
    Bytes bytes;
  };
  std::vector<Set> sets_;  ///< sets of tables
};

}  // namespace terrace::stream::store
