// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>

#include "store/codec/bytes.hpp"

namespace terrace::stream::store {

/// A file descriptor that closes itself.
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

/// A new file, written front to back through a buffer, its CRC-32 kept along.
/// Every failed write, also one that shows only at fsync or close, is thrown as an Error.
class OutputFile {
 public:
  explicit OutputFile(std::filesystem::path path);

  void write(ByteView bytes);
  /// Writes what is buffered, syncs and closes.
  void finish();
  [[nodiscard]] std::uint64_t size() const { return size_; }
  [[nodiscard]] std::uint32_t checksum() const { return checksum_; }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  void flush();

  std::filesystem::path path_;
  Descriptor fd_;
  Bytes buffer_;
  std::uint64_t size_ = 0, flushed_ = 0;
  std::uint32_t checksum_ = 0;
};

/// fsync of a folder. Throws: Error.
void sync_folder(const std::filesystem::path& folder);

}  // namespace terrace::stream::store
