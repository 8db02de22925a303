// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <terrace/base/box.hpp>

/// Points and boxes, in the frame that their owner documents.

namespace terrace::stream {

using base::Box3;
using base::Point3;

}  // namespace terrace::stream
