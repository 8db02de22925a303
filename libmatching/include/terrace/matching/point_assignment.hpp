// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include <terrace/base/stop_check.hpp>

#include "terrace/matching/assignment.hpp"
#include "terrace/matching/point.hpp"

namespace terrace::matching {

/// Minimum-cost assignment of points to points by Euclidean distance. The result is optimal among
/// all pairs, although only near pairs are examined.
///
/// Each row starts with its nearest columns as candidates and with a lower bound of cost minus
/// label over all other columns. If a search reaches that bound before it ends, the row gets the
/// next columns by cost minus label, from a tree of the columns that holds the largest label below
/// each node. So no absent pair ever violates the labels. If both sets are equally large, labels
/// start from bounded rounds of bidding (D. Bertsekas, "The auction algorithm", 1988).
///
/// Requires: coordinates finite and at most kLargestCost in magnitude. Distances below 1e-150 times
/// the largest coordinate count as 0.
/// Returns: the assignment of min(rows, columns) rows with labels for all pairs, in the unit of the
/// coordinates, up to rounding.
/// Throws: std::invalid_argument for a coordinate that violates this (the message names the set and
/// the index).
/// Cost: depends on how far apart the sets are. Memory grows with the number of candidates. The
/// worst case is that of the complete graph: O(n^3) time and 16 bytes per pair.
/// Source: J. Skála, 4.3.1, and pricing as in R. Jonker and A. Volgenant, 1987 (their sparse code
/// on dense problems).
Assignment assign_points(std::span<const Point2> rows, std::span<const Point2> columns,
                         const base::StopCheck& check_stop = {});
Assignment assign_points(std::span<const Point3> rows, std::span<const Point3> columns,
                         const base::StopCheck& check_stop = {});

/// As check() in assignment.hpp, on all pairs.
///
/// Cost: O(rows * columns) time.
double check_points(const Assignment& assignment, std::span<const Point2> rows,
                    std::span<const Point2> columns);
double check_points(const Assignment& assignment, std::span<const Point3> rows,
                    std::span<const Point3> columns);

}  // namespace terrace::matching
