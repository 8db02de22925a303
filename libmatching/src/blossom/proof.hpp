// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "blossom/solver.hpp"
#include "terrace/matching/matching.hpp"

namespace terrace::matching::blossom {

/// What the solver knows as the public result: partners and duals, the blossoms numbered from 0.
/// The caller fills cost and exponent.
Matching proof_of(Solver& solver);

/// The message for a vertex that solve() could not match.
std::string unmatchable(const Solver& solver, std::uint32_t vertex);

}  // namespace terrace::matching::blossom
