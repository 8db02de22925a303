// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "blossom/solver.hpp"
#include "terrace/matching/matching.hpp"

namespace terrace::matching::blossom {

/// Converts the solver's result to the public type: partners and duals, with blossoms numbered from
/// 0. Leaves cost and exponent to the caller.
Matching proof_of(Solver& solver);

/// Returns the error message for a vertex that solve() could not match.
std::string unmatchable(const Solver& solver, std::uint32_t vertex);

}  // namespace terrace::matching::blossom
