// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>

#include "store/codec/bytes.hpp"

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

}  // namespace terrace::stream::store
