// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

/// Whole files in gzip's form (RFC 1952), in memory.

namespace terrace::stream {

/// True if `bytes` begin as gzip does.
bool is_gzip(std::span<const std::byte> bytes);

/// Compressed; no time and no name are in it, so equal bytes give equal bytes. level: 1 (fast) to
/// 12 (small).
std::vector<std::byte> gzip(std::span<const std::byte> bytes, int level = 6);

/// The bytes again. most: how many there may be; what claims more is refused before it is unpacked.
/// name: for messages. Throws: Error if `bytes` are damaged or no gzip, or hold more than `most`.
std::vector<std::byte> gunzip(std::span<const std::byte> bytes, std::uint64_t most,
                              const std::string& name);

}  // namespace terrace::stream
