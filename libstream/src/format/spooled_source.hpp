// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <string>

#include "terrace/stream/source.hpp"

namespace terrace::stream {

/// What `format.open` makes of the files, those that are not seekable (pipes, gzip) being read to
/// their end first and set aside in temporary files without names. Messages have the names of
/// `files`. Throws: Error, Stopped.
std::unique_ptr<PointSource> open_spooled(const Format& format, std::span<const std::string> files,
                                          const SourceOptions& options);

}  // namespace terrace::stream
