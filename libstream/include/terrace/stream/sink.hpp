// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>

#include "terrace/stream/atomic_file.hpp"

namespace terrace::stream {

class StopWaiter;

/// The destination of a writer's bytes: a file that appears when it is complete, or standard output
/// for "-".
class Sink {
 public:
  /// replace: whether an existing file is replaced. stop: ends writing, and a wait for the reader
  /// of standard output. Throws: as AtomicFile does.
  Sink(const std::string& path, const Naming& replace, const std::stop_token& stop = {});
  ~Sink();
  Sink(const Sink&) = delete;
  Sink& operator=(const Sink&) = delete;

  /// Appends bytes. Throws: Error if writing fails, Stopped, and for standard output ClosedPipe;
  /// some failures are found only by commit().
  void write(std::string_view text);
  void write(std::span<const std::byte> bytes) {
    write(std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
  }
  /// Overwrites bytes written before; for files only.
  void write_at(std::uint64_t offset, std::string_view text);
  /// Bytes written so far.
  [[nodiscard]] std::uint64_t size() const { return size_; }
  /// Publishes the file, or flushes standard output.
  void commit();

 private:
  void flush();
  void check_stop() const;

  std::optional<AtomicFile> file_;      ///< nullopt: standard output
  std::string pending_;                 ///< for standard output
  std::unique_ptr<StopWaiter> waiter_;  ///< if standard output may block
  std::stop_token stop_;
  std::uint64_t size_ = 0;
};

}  // namespace terrace::stream
