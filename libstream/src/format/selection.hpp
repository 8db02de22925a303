// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "terrace/stream/source.hpp"

namespace terrace::stream {

/// Returns the part of a source selected by options.selection; the source itself if everything is
/// selected. Blocks of points are filled up again, blocks of a raster remain its tiles. Throws:
/// Error for an invalid condition and for unknown names.
std::unique_ptr<PointSource> selection_of(std::unique_ptr<PointSource> source,
                                          const SourceOptions& options);

/// Returns the source with only the attributes among `names`, in the order of `names`.
std::unique_ptr<PointSource> with_attributes(std::unique_ptr<PointSource> source,
                                             const std::vector<std::string>& names,
                                             std::size_t block_points);

/// Returns the attributes that are kept or named by the condition: no others need to be read.
/// Throws: Error for an invalid condition.
std::vector<std::string> needed_attributes(const SourceInfo& info, const SourceOptions& options);

/// Throws: Error that names `file` if one of `names` is not an attribute.
void check_attributes(const std::vector<std::string>& names, const std::vector<Channel>& attributes,
                      const std::string& file);

}  // namespace terrace::stream
