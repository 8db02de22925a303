// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

/// Complete files in gzip format (RFC 1952), in memory.

namespace terrace::stream {

/// True if `bytes` begin with the signature of gzip.
bool is_gzip(std::span<const std::byte> bytes);

/// Compresses. Stores neither time nor name, so equal input gives equal output. level: 1 (fast) to
/// 12 (small).
std::vector<std::byte> gzip(std::span<const std::byte> bytes, int level = 6);

/// Decompresses. max_bytes: the maximum size; data that claims more is refused before it is
/// decompressed. name: for messages. Throws: Error if `bytes` are damaged, not gzip, or decompress
/// to more than `max_bytes` bytes.
std::vector<std::byte> gunzip(std::span<const std::byte> bytes, std::uint64_t max_bytes,
                              const std::string& name);

}  // namespace terrace::stream
