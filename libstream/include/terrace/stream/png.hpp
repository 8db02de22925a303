// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <stop_token>

#include "terrace/stream/atomic_file.hpp"

namespace terrace::stream {

/// Writes a PNG image of 8 bits per channel, rows from top to bottom, without padding.
///
/// channels: 1 grey, 2 grey and alpha, 3 RGB, 4 RGBA. pixels: width * height * channels values. The
/// file appears complete and synced, or not at all; an existing file is replaced only with
/// `replace`. "-" is standard output; `stop` ends a wait for its reader.
/// Throws: Error if the image is empty or larger than 2^31 - 1 on a side, or cannot be written.
void write_png(const std::filesystem::path& path, std::size_t width, std::size_t height,
               int channels, std::span<const std::uint8_t> pixels, const Naming& replace = {},
               const std::stop_token& stop = {});

/// Writes a PNG image of one grey channel of 16 bits, likewise. samples: width * height values.
void write_png_grey16(const std::filesystem::path& path, std::size_t width, std::size_t height,
                      std::span<const std::uint16_t> samples, const Naming& replace = {},
                      const std::stop_token& stop = {});

}  // namespace terrace::stream
