// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "terrace/stream/source.hpp"

namespace terrace::stream {

/// Text of one point per line: XYZ, CSV and their like.
const Format& xyz_format();

}  // namespace terrace::stream
