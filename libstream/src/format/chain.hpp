// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>

#include "terrace/stream/source.hpp"

namespace terrace::stream {

/// Opens one file of a format.
using OpenOne =
    std::function<std::unique_ptr<PointSource>(const std::string& file, const SourceOptions&)>;

/// Opens several files as one source that reads them in order; a single file is opened as it is.
/// Checks each file's header immediately and reopens the file when its turn comes; pipes are opened
/// only once. Throws: Error if a file cannot be opened or differs from the first in channels or
/// CRS.
std::unique_ptr<PointSource> open_in_sequence(std::span<const std::string> files,
                                              const SourceOptions& options,
                                              const OpenOne& open_one);

}  // namespace terrace::stream
