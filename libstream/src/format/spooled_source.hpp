// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <string>

#include "terrace/stream/source.hpp"

namespace terrace::stream {

/// The result of `format.open` for the files, after reading those without random access (pipes,
/// gzip) to their end into unnamed temporary files. Messages have the names of `files`. Throws:
/// Error, Stopped.
std::unique_ptr<PointSource> open_spooled(const Format& format, std::span<const std::string> files,
                                          const SourceOptions& options);

}  // namespace terrace::stream
