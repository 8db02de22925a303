// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "terrace/stream/source.hpp"

namespace terrace::stream {

/// The Stanford polygon format: ASCII, binary little-endian and big-endian.
const Format& ply_format();

}  // namespace terrace::stream
