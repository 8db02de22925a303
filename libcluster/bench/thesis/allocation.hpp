// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

/// How much memory the program has allocated: allocation.cpp replaces operator new and delete of
/// the whole program.

namespace terrace::cluster::thesis {

/// The most bytes alive at once since the construction, beyond those alive at the construction.
/// One at a time; memory of all threads counts.
class PeakMemory {
 public:
  PeakMemory();
  [[nodiscard]] std::size_t bytes() const;

 private:
  std::size_t before_;
};

}  // namespace terrace::cluster::thesis
