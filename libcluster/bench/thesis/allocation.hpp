// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

/// The memory allocated by the program: allocation.cpp replaces operator new and delete of the
/// whole program.

namespace terrace::cluster::thesis {

/// The peak of live bytes since construction, beyond those alive at construction. One object at a
/// time; memory of all threads counts.
class PeakMemory {
 public:
  PeakMemory();
  [[nodiscard]] std::size_t bytes() const;

 private:
  std::size_t before_;
};

}  // namespace terrace::cluster::thesis
