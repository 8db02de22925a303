// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "terrace/stream/byte_source.hpp"

namespace terrace::stream {

/// A temporary file without a name: what it takes is free again as soon as the object goes, however
/// the process ends. Holds what can only be read front to back (packed files, text, pipes) where it
/// is needed at any place.
class Spool final : public ByteSource {
 public:
  /// name: of what is spooled, for messages. folder: where; empty: $TMPDIR or /tmp.
  /// Throws: Error if no file can be made.
  explicit Spool(std::string name, const std::filesystem::path& folder = {});
  ~Spool() override;
  Spool(const Spool&) = delete;
  Spool& operator=(const Spool&) = delete;

  /// Throws: Error, if the disk is full above all.
  void append(std::span<const std::byte> bytes) { write(size_, bytes); }
  /// Writes at any place; what is skipped reads as zero.
  void write(std::uint64_t offset, std::span<const std::byte> bytes);

  [[nodiscard]] const std::string& name() const override { return name_; }
  /// A name by which this process can open it, for what takes names only.
  [[nodiscard]] std::string path() const { return "/proc/self/fd/" + std::to_string(descriptor_); }
  [[nodiscard]] std::uint64_t size() const override { return size_; }
  void read(std::uint64_t offset, std::span<std::byte> out) const override;

 private:
  std::string name_, remedy_;
  int descriptor_;
  std::uint64_t size_ = 0;
};

}  // namespace terrace::stream
