// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

#include "terrace/stream/source.hpp"

namespace terrace::tools {

/// Value `i` of a column, whatever its type; integers of 64 bits are rounded.
double value_at(const stream::Column& column, std::size_t i);

}  // namespace terrace::tools
