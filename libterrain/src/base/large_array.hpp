// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>
#include <type_traits>

#ifdef __linux__
#include <sys/mman.h>
#endif

namespace terrace::terrain {

struct FreeMemory {
  void operator()(void* memory) const { std::free(memory); }
};
template <class T>
using LargeArray = std::unique_ptr<T[], FreeMemory>;

/// Allocates plain data without initialising it, so each page is first touched by the thread that
/// fills it. Uses huge pages where the system has them, because arrays that are sorted into cells
/// are filled in random order.
template <class T>
LargeArray<T> large_array(std::size_t count) {
  static_assert(std::is_trivially_copyable_v<T>);
  constexpr std::size_t kHugePage = std::size_t{2} << 20;
  const std::size_t bytes = count * sizeof(T);
  void* memory = nullptr;
  if (posix_memalign(&memory, bytes < kHugePage ? alignof(std::max_align_t) : kHugePage, bytes) !=
      0) {
    throw std::bad_alloc();
  }
#ifdef __linux__
  // Only a hint, so a failure does not matter.
  if (bytes >= kHugePage) static_cast<void>(madvise(memory, bytes, MADV_HUGEPAGE));
#endif
  return LargeArray<T>(static_cast<T*>(memory));
}

}  // namespace terrace::terrain
