// SPDX-License-Identifier: GPL-3.0-or-later
#include <atomic>
#include <cstddef>

#include <terrace/base/parallel.hpp>

int main() {
  std::atomic<std::size_t> sum = 0;
  terrace::base::parallel_for(101, 2, [&](std::size_t i) { sum += i; });
  return sum == 5050 ? 0 : 1;
}
