// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

namespace terrace::cluster {

/// A point in the frame its owner names. A standard type, so that it is the same type in every
/// library of the workspace.
using Point3 = std::array<double, 3>;

}  // namespace terrace::cluster
