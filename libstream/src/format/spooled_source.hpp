// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <string>

#include "terrace/stream/source.hpp"

namespace terrace::stream {

/// Opens the files with `format.open`, after copying those without random access (pipes, gzip) to
/// unnamed temporary files. Messages name the original files. Throws: Error, Stopped.
std::unique_ptr<PointSource> open_spooled(const Format& format, std::span<const std::string> files,
                                          const SourceOptions& options);

}  // namespace terrace::stream
