// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <stop_token>
#include <string>
#include <vector>

namespace terrace::stream {

/// Returns the name of a file for messages: "standard input" for kStandardStream.
std::string shown_name(const std::string& file);

/// True for a file that can be reopened from its start; false for pipes and standard input.
bool is_rereadable(const std::string& file);

/// True for a rereadable file with random access, that is, not gzip.
bool is_seekable(const std::string& file);

/// Returns the first bytes of a file, at most `max_bytes`, decompressed if it is gzip (see Input).
/// Bytes read from a pipe are kept for the next Input of that name on this thread, or until
/// drop_heads(). Throws: Error if the file cannot be opened or read, Stopped.
std::vector<char> peek_head(const std::string& file, std::size_t max_bytes,
                            const std::stop_token& stop);
/// Forgets unused bytes kept by peek_head().
void drop_heads();

}  // namespace terrace::stream
