// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <string>

#include "terrace/stream/source.hpp"

namespace terrace::stream {

/// Opens one file of a format. first: the properties of the first of several files; null for the
/// first.
using OpenOne = std::unique_ptr<PointSource> (*)(const std::string& file,
                                                 const SourceOptions& options,
                                                 const SourceInfo* first);

/// Several files, one after the other, as one source; a single one unchanged. Checks the head of
/// each immediately and (re)opens it when its turn comes; pipes are opened only once. Throws: Error
/// if one cannot be opened or differs from the first in channels or CRS.
std::unique_ptr<PointSource> open_in_turn(std::span<const std::string> files,
                                          const SourceOptions& options, OpenOne open_one);

}  // namespace terrace::stream
