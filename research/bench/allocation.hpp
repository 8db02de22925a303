// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

/// Measures the memory allocated by the program. allocation.cpp replaces operator new and delete of
/// the whole program.

namespace terrace::research {

/// The peak of live bytes since construction, minus those live at construction. Only one object may
/// exist at a time. Memory of all threads counts.
class PeakMemory {
 public:
  PeakMemory();
  [[nodiscard]] std::size_t bytes() const;

 private:
  std::size_t initial_;
};

}  // namespace terrace::research
