// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "terrace/stream/byte_source.hpp"

namespace terrace::stream {

/// A temporary file without a name, whose space is freed when the object is destroyed or the
/// process ends in any way. Holds data that can only be read front to back (compressed files, text,
/// pipes) but needs random access.
class Spool final : public ByteSource {
 public:
  /// Creates a temporary file. name: the spooled input, named in errors. folder: where to create
  /// the file, or empty for $TMPDIR or /tmp. Throws: Error if the file cannot be created.
  explicit Spool(std::string name, const std::filesystem::path& folder = {});
  ~Spool() override;
  Spool(const Spool&) = delete;
  Spool& operator=(const Spool&) = delete;

  /// Appends bytes. Throws: Error, usually because the disk is full.
  void append(std::span<const std::byte> bytes) { write(size_, bytes); }
  /// Writes at any position; gaps read as zero. Different parts may be written at the same time.
  void write(std::uint64_t offset, std::span<const std::byte> bytes);

  [[nodiscard]] const std::string& name() const override { return name_; }
  /// Returns a path by which this process can open the file, for interfaces that need one.
  [[nodiscard]] std::string path() const { return "/proc/self/fd/" + std::to_string(descriptor_); }
  [[nodiscard]] std::uint64_t size() const override { return size_; }
  void read(std::uint64_t offset, std::span<std::byte> out) const override;

 private:
  std::string name_, remedy_;
  int descriptor_;
  std::atomic<std::uint64_t> size_ = 0;
};

}  // namespace terrace::stream
