// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace terrace::stream {

/// A part of one file.
struct BytePart {
  std::uint64_t offset = 0, bytes = 0;
};

/// Bytes with random access, from a file, memory, a server or elsewhere.
class ByteSource {
 public:
  virtual ~ByteSource() = default;

  /// The name for error messages; the path of a file.
  [[nodiscard]] virtual const std::string& name() const = 0;
  [[nodiscard]] virtual std::uint64_t size() const = 0;
  /// Fills `out` with the bytes from `offset` on. Requires offset + out.size() <= size(). May be
  /// called by several threads at once. Throws: Error if the bytes cannot be read.
  virtual void read(std::uint64_t offset, std::span<std::byte> out) const = 0;

  /// Number of bytes that prefetch() should be given at a time; 0 if it does nothing, because reads
  /// are fast without it.
  [[nodiscard]] virtual std::uint64_t prefetch_bytes() const { return 0; }
  /// Requests the parts, which must exist, together, so that reads of them that follow soon do not
  /// wait one after the other. May be called by several threads at once. Throws: Error if the bytes
  /// cannot be read.
  virtual void prefetch(std::span<const BytePart> parts) const { static_cast<void>(parts); }
};

/// Opens a regular file, to be read with pread(2). Throws: Error if it is not a regular file or
/// cannot be opened.
[[nodiscard]] std::unique_ptr<ByteSource> open_file(const std::filesystem::path& path);

/// Serves bytes from memory.
[[nodiscard]] std::unique_ptr<ByteSource> bytes_in_memory(std::string name,
                                                          std::vector<std::byte> bytes);

/// Serves `size` bytes through the caller's function, which follows the contract of
/// ByteSource::read().
[[nodiscard]] std::unique_ptr<ByteSource> bytes_by_function(
    std::string name, std::uint64_t size,
    std::function<void(std::uint64_t offset, std::span<std::byte> out)> read);

/// Opens a file by its name ("manifest.json") in a folder, an archive, on a server or the like.
/// Throws: Error if it does not exist.
using OpenByName = std::function<std::unique_ptr<ByteSource>(const std::string& name)>;

}  // namespace terrace::stream
