// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "io/spool.hpp"
#include "order/kd_cut.hpp"
#include "order/record_packer.hpp"
#include "terrace/stream/point.hpp"
#include "terrace/stream/schema.hpp"
#include "terrace/stream/source.hpp"

namespace terrace::stream {

/// What a bucket holds in memory at most: of 256 buckets 8 MiB, and few enough writes.
inline constexpr std::size_t kBucketBytes = 32u << 10;

/// Points as records of their stored types: the coordinates, then the attributes.
class PackedPoints {
 public:
  explicit PackedPoints(const Schema& schema);

  [[nodiscard]] std::size_t record_bytes() const { return record_bytes_; }
  /// Replaces what is in `records` by those of the block.
  void pack(const PointBlock& block, std::vector<std::byte>& records) const;
  /// Whether all coordinates are integers of at most 32 bits, with a sign if of 32.
  [[nodiscard]] bool integers() const { return integers_; }
  /// Replaces what is in `points` by the places in the records, numbered from 0. 32-bit integers
  /// require integers().
  template <class Coordinate>
  void unpack(std::span<const std::byte> records, std::vector<Numbered<Coordinate>>& points) const;
  /// Replaces what is in `sorted` by the records in the order of their keys, those of a key in the
  /// order in which they come, and what is in `begins` by where those of each key below `keys_end`
  /// begin, and the end.
  void sort(std::span<const std::byte> records, std::span<const std::uint16_t> keys,
            std::size_t keys_end, std::vector<std::byte>& sorted,
            std::vector<std::size_t>& begins) const;
  /// The same for the records of a block.
  void sort(const PointBlock& block, std::span<const std::uint16_t> keys, std::size_t keys_end,
            std::vector<std::byte>& sorted, std::vector<std::size_t>& begins) const;
  /// Replaces what is in `block` by some of the records, which `numbers` counts from 0.
  void unpack(std::span<const std::byte> records, std::span<const std::uint32_t> numbers,
              PointBlock& block) const;

 private:
  [[nodiscard]] std::size_t payload_bytes() const { return record_bytes_ - payload_offset_; }
  /// Calls write(pack), where pack(i, to) writes the record of a point of the block.
  template <class Write>
  void with_packing(const PointBlock& block, const Write& write) const;
  /// Calls read(unpack), where unpack(record) returns the place in a record.
  template <class Coordinate, class Read>
  void with_unpacking(const Read& read) const;
  /// Calls put(i, to) for each key in turn, which writes the record that has it.
  template <class Put>
  void sort_by(std::span<const std::uint16_t> keys, std::size_t keys_end,
               std::vector<std::byte>& sorted, std::vector<std::size_t>& begins,
               const Put& put) const;

  std::array<ScalarType, 3> types_;
  std::array<std::size_t, 3> offsets_{};
  std::size_t payload_offset_, record_bytes_;
  bool integers_ = true;
};

/// Records that belong together, in the order in which they came: full chunks in a file, the rest
/// in memory.
struct Bucket {
  /// Records in the file.
  struct Chunk {
    std::uint32_t page, pages;  ///< its place, in pages of the file
    std::uint32_t bytes;        ///< that are used; as many as in memory: not packed
  };

  std::vector<Chunk> chunks;
  std::vector<std::byte> tail;

  void append(Bucket&& next);
};

/// Buckets of records in one temporary file, in chunks whose place is used again once they have
/// been read.
class BucketFile {
 public:
  /// name: of what is set aside, for messages.
  BucketFile(const std::string& name, const std::filesystem::path& folder,
             std::size_t record_bytes);

  /// Appends records. Threads may do so at the same time, each with a packer and with buckets of
  /// its own. Throws: Error, if the disk is full above all.
  void append(Bucket& bucket, std::span<const std::byte> records, RecordPacker& packer);
  /// The same, when no other thread appends any.
  void append(Bucket& bucket, std::span<const std::byte> records) {
    append(bucket, records, packer_);
  }
  [[nodiscard]] std::uint64_t records(const Bucket& bucket) const;
  /// Moves the first records of the bucket, whole chunks and at most about so many, to `out`, whose
  /// former content is lost.
  void take(Bucket& bucket, std::uint64_t most, std::vector<std::byte>& out);
  /// Copies records of chunks throughout the bucket, at most so many, to `out`.
  void sample(const Bucket& bucket, std::uint64_t most, std::vector<std::byte>& out);
  /// What the file takes.
  [[nodiscard]] std::uint64_t bytes() const { return pages_ * kPageBytes; }

 private:
  /// Unit of places in the file: up to 4 TiB.
  static constexpr std::uint64_t kPageBytes = 1024;
  /// Chunks at the end of the file are written together, at least so many bytes: the system does
  /// more work for short writes, and for what they wrote when it is read, and one at a time.
  static constexpr std::size_t kWrittenBytes = 256u << 10;

  Bucket::Chunk room_for(std::size_t bytes);
  void write(Bucket& bucket, RecordPacker& packer);
  void read(const Bucket::Chunk& chunk, std::span<std::byte> records);

  std::size_t record_bytes_, chunk_bytes_;  ///< of records that are not packed
  Spool file_;
  RecordPacker packer_;
  std::vector<std::byte> packed_;
  std::mutex mutex_;                                          ///< of what follows
  std::uint32_t pages_ = 0;                                   ///< in the file and to come
  std::uint64_t coming_page_ = 0;                             ///< where the file's end will be
  std::vector<std::byte> coming_;                             ///< written next, from there on
  std::vector<std::byte> spare_;                              ///< a buffer, empty
  std::map<std::uint32_t, std::vector<std::uint32_t>> free_;  ///< places, by their size
};

}  // namespace terrace::stream
