// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "format/las/record_reader.hpp"
#include "terrace/stream/source.hpp"

/// Point records in parts that can be read independently: chunks of LAZ, nodes of an octree.

namespace terrace::stream {

/// Reads parts, one at a time. Each thread has its own.
class PartReader {
 public:
  virtual ~PartReader() = default;
  /// Moves to the first record of a part. Throws: Error.
  virtual void start(std::size_t part) = 0;
  /// Reads records of the part to the beginning of `room`: at least one, at most as many as fit.
  /// Returns their bytes. Called only for records that RecordParts promises. Throws: Error if they
  /// do not exist, or if the part does not end after the last one.
  virtual std::size_t read(std::span<std::byte> room) = 0;
};

/// The size of a part.
struct RecordPart {
  std::uint64_t points = 0;
  std::uint64_t bytes = 0;  ///< in the file
};

/// The parts of a file, and a function that makes a reader for a thread.
struct RecordParts {
  std::size_t record_bytes = 0;
  std::vector<RecordPart> parts{};
  /// Called by several threads at once, but only while the RecordReader lives.
  std::function<std::unique_ptr<PartReader>()> make_reader{};
};

/// Returns the records of the parts, in order, read by up to options.threads threads, a few parts
/// ahead of the current one and within options.memory_bytes. Null if several threads would not help
/// and there is no handler for damage, or if the memory does not suffice.
std::unique_ptr<RecordReader> parts_ahead(const RecordParts& parts, const SourceOptions& options);
/// Like parts_ahead(), but on the caller's thread and in small pieces: a part's records are never
/// all in memory, however many points it has.
std::unique_ptr<RecordReader> parts_in_sequence(RecordParts parts);
/// parts_ahead() if that returns a reader, otherwise parts_in_sequence().
std::unique_ptr<RecordReader> records_of_parts(RecordParts parts, const SourceOptions& options);

}  // namespace terrace::stream
