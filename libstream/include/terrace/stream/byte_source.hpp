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

/// Bytes with random access: a file, memory, or anything else.
class ByteSource {
 public:
  virtual ~ByteSource() = default;

  /// The name in error messages; for a file the path.
  [[nodiscard]] virtual const std::string& name() const = 0;
  [[nodiscard]] virtual std::uint64_t size() const = 0;
  /// Fills `out` with the bytes from `offset` on. Requires offset + out.size() <= size(). Called by
  /// several threads at once. Throws: Error if they cannot be read.
  virtual void read(std::uint64_t offset, std::span<std::byte> out) const = 0;
};

/// A regular file, read with pread(2). Throws: Error if it is not one or cannot be opened.
[[nodiscard]] std::unique_ptr<ByteSource> open_file(const std::filesystem::path& path);

/// Bytes in memory.
[[nodiscard]] std::unique_ptr<ByteSource> bytes_in_memory(std::string name,
                                                          std::vector<std::byte> bytes);

/// `size` bytes read by the caller's function, under the contract of ByteSource::read().
[[nodiscard]] std::unique_ptr<ByteSource> bytes_by_function(
    std::string name, std::uint64_t size,
    std::function<void(std::uint64_t offset, std::span<std::byte> out)> read);

/// Opens a file of a folder, or of anything that acts as one, by its name ("manifest.json").
/// Throws: Error if it does not exist.
using OpenByName = std::function<std::unique_ptr<ByteSource>(const std::string& name)>;

}  // namespace terrace::stream
