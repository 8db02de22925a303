// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <terrace/base/box.hpp>

/// Points and boxes in a Cartesian frame and a unit chosen by the caller.

namespace terrace::cluster {

using base::Box3;
using base::Point3;

}  // namespace terrace::cluster
