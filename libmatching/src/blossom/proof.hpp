// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "blossom/solver.hpp"
#include "terrace/matching/matching.hpp"

namespace terrace::matching::blossom {

/// Converts the solver's result to the public one: partners and duals, with blossoms numbered from
/// 0. The caller fills in cost and exponent.
Matching proof_of(Solver& solver);

/// The message for a vertex that solve() could not match.
std::string unmatchable(const Solver& solver, std::uint32_t vertex);

}  // namespace terrace::matching::blossom
