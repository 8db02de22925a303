// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "tables/cluster_run.hpp"
#include "tables/point_table.hpp"

namespace terrace::tools {

/// One cluster number per line, in the order of the input; -1 for outliers. "-" is standard output.
/// Throws: stream::Error; ClosedPipe.
void write_labels(const std::string& path, const ClusterOutcome& outcome, bool replace);

/// The table with two more columns, `cluster` and `representative` (the number of the point that
/// stands for the cluster), both -1 for outliers; columns of these names are replaced. format: of
/// point files, empty: by ending. Throws: stream::Error, Interrupted.
void write_clustered(const std::string& path, const std::string& format, const PointTable& table,
                     const ClusterOutcome& outcome, bool replace);

}  // namespace terrace::tools
