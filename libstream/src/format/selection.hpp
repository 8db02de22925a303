// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "terrace/stream/source.hpp"

namespace terrace::stream {

/// The part of a source selected by options.selection; the source itself if everything is selected.
/// Blocks of points are refilled, those of a raster remain its tiles. Throws: Error for an invalid
/// condition and for unknown names.
std::unique_ptr<PointSource> selection_of(std::unique_ptr<PointSource> source,
                                          const SourceOptions& options);

}  // namespace terrace::stream
