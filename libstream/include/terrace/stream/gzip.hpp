// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

/// Complete files in gzip format (RFC 1952), in memory.

namespace terrace::stream {

/// True if `bytes` begin like gzip.
bool is_gzip(std::span<const std::byte> bytes);

/// Compresses, without time and name, so that equal bytes give equal bytes. level: 1 (fast) to 12
/// (small).
std::vector<std::byte> gzip(std::span<const std::byte> bytes, int level = 6);

/// Decompresses. most: the limit of the size; data that claims more is refused before it is
/// decompressed. name: for messages. Throws: Error if `bytes` are damaged or not gzip, or hold more
/// than `most`.
std::vector<std::byte> gunzip(std::span<const std::byte> bytes, std::uint64_t most,
                              const std::string& name);

}  // namespace terrace::stream
