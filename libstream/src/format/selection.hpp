// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "terrace/stream/source.hpp"

namespace terrace::stream {

/// What options.selection leaves of a source; the source itself if they ask for nothing.
/// Blocks of points are filled up again, those of a raster stay the tiles that they are.
/// Throws: Error for a condition that makes no sense and names that are not there.
std::unique_ptr<PointSource> selection_of(std::unique_ptr<PointSource> source,
                                          const SourceOptions& options);

}  // namespace terrace::stream
