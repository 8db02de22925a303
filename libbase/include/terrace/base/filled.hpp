// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "terrace/base/stop_check.hpp"

namespace terrace::base {

/// Returns a vector of `count` copies of `value`. The first touch of gigabytes takes seconds, so
/// the check is called every 4 MiB. Throws whatever the check throws, and std::bad_alloc.
template <class T>
std::vector<T> filled(std::size_t count, const T& value, const StopCheck& check_stop) {
  constexpr std::size_t kStep = std::max<std::size_t>((std::size_t{1} << 22) / sizeof(T), 1);
  std::vector<T> values;
  values.reserve(count);
  while (values.size() < count) {
    if (check_stop) check_stop();
    values.resize(std::min(count, values.size() + kStep), value);
  }
  return values;
}

}  // namespace terrace::base
