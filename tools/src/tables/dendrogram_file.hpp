// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include <terrace/cluster/dendrogram.hpp>

#include "terrace/stream/atomic_file.hpp"

namespace terrace::tools {

/// Writes SciPy's linkage matrix as text rows "a,b,height,size"; "-" is standard output. Heights
/// are the shortest decimals that read back as the same double. Throws stream::Error.
void write_dendrogram(const std::string& path, const cluster::Dendrogram& dendrogram,
                      const stream::Naming& naming);

/// Reads the dendrogram from a file that starts with the line "a,b,height,size"; returns nullopt
/// for any other file. Throws stream::Error, which names the line, if a row is malformed or the
/// rows do not form a dendrogram. check_rows: called at intervals with the number of rows read so
/// far, and at the end; an exception from it ends the reading.
std::optional<cluster::Dendrogram> read_dendrogram(
    const std::string& path, const std::function<void(std::uint64_t rows)>& check_rows = {});

}  // namespace terrace::tools
