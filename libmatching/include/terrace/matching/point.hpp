// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

namespace terrace::matching {

/// Points in the plane and in space. Standard types, so that they are the same in every library.
using Point2 = std::array<double, 2>;
using Point3 = std::array<double, 3>;

}  // namespace terrace::matching
