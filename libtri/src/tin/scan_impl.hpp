// SPDX-License-Identifier: Apache-2.0
#pragma once

// Includes all scans. The includer must first define the functions on masks of lanes:
// not_negative(), at_most(), more(), at_least(), above(), mask_or(), mask_and(), blend(),
// zero_unless(), exceeding(), equal(), bits_of().
#include "scan.hpp"
#include "scan_grid.hpp"
#ifndef TERRACE_TRI_NARROW_LANES
#include "scan_check.hpp"
#include "scan_rows.hpp"
#endif
