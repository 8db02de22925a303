// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>

#include <terrace/tri/smoothing.hpp>

namespace terrace::tools {

/// What --smooth says: laplacian, taubin or bilateral, and after a colon how many steps (10 unless
/// given, at most 10,000). bilateral's edge_height stays 0: it depends on the data.
/// Throws: UsageError. Nothing for an empty text.
std::optional<tri::SmoothingOptions> parse_smoothing(const std::string& text);

}  // namespace terrace::tools
