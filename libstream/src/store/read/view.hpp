// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <mutex>
#include <utility>

#include "terrace/stream/store.hpp"

namespace terrace::stream {

struct Store::View {
  /// A search through the hierarchy, which programs that make no views need not contain.
  using FindBounds = Box3 (*)(const Store& view);

  Where condition;
  FindBounds find_bounds;
  std::once_flag once;
  Box3 bounds;  ///< once they were asked for

  View(Where where, FindBounds find) : condition(std::move(where)), find_bounds(find) {}
};

}  // namespace terrace::stream
