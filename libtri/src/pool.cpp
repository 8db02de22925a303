// SPDX-License-Identifier: Apache-2.0
#include "pool.hpp"

#include <cstdlib>
#include <cstring>
#include <new>

#ifdef __linux__
#include <sys/mman.h>
#endif

namespace terrace::tri {
namespace {

void* checked(void* memory) {
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

#ifdef __linux__

// Smaller arrays are on the heap: mappings are too coarse and too expensive for them.
constexpr std::size_t kMapFrom = std::size_t{8} << 20;

std::size_t round_up(std::size_t bytes, std::size_t unit) {
  return (bytes + unit - 1) / unit * unit;
}

// Huge pages where whole ones fit. A last part stays in small pages automatically. The whole
// mapping is advised, including that part: the kernel refuses to move a mapping whose parts have
// different advice.
void advise(void* memory, std::size_t bytes) {
  // Only a hint: without it everything works, but more slowly.
  if (bytes >= kHugePage) (void)madvise(memory, bytes, MADV_HUGEPAGE);
}

void* map(std::size_t bytes) {
  constexpr std::size_t kSmallPage = 4096;
  const std::size_t length = round_up(bytes, kSmallPage);
  // Aligned to a huge page by cutting the ends off a larger mapping.
  void* raw = mmap(nullptr, length + kHugePage, PROT_READ | PROT_WRITE,
                   MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (raw == MAP_FAILED) throw std::bad_alloc();
  char* begin = static_cast<char*>(raw);
  const std::size_t head = round_up(reinterpret_cast<std::uintptr_t>(begin), kHugePage) -
                           reinterpret_cast<std::uintptr_t>(begin);
  if (head > 0) munmap(begin, head);
  if (head < kHugePage) munmap(begin + head + length, kHugePage - head);
  advise(begin + head, bytes);
  return begin + head;
}

// Grows a mapping in place, or moves it to an address that keeps its huge pages whole. At an
// address chosen by the kernel they would all be split into small ones.
void* remap(void* memory, std::size_t old_bytes, std::size_t new_bytes) {
  void* grown = mremap(memory, old_bytes, new_bytes, 0);
  if (grown == MAP_FAILED) {
    void* target = map(new_bytes);
    grown = mremap(memory, old_bytes, new_bytes, MREMAP_MAYMOVE | MREMAP_FIXED, target);
    if (grown == MAP_FAILED) {
      munmap(target, new_bytes);
      throw std::bad_alloc();
    }
  }
  advise(grown, new_bytes);
  return grown;
}

#endif

}  // namespace

void* allocate_pages(std::size_t bytes) {
#ifdef __linux__
  if (bytes >= kMapFrom) return map(bytes);
#endif
  return checked(std::malloc(bytes));
}

void* resize_pages(void* memory, std::size_t old_bytes, std::size_t new_bytes) {
#ifdef __linux__
  if (old_bytes >= kMapFrom && new_bytes >= kMapFrom) return remap(memory, old_bytes, new_bytes);
  if (old_bytes >= kMapFrom || new_bytes >= kMapFrom) {
    void* moved = allocate_pages(new_bytes);
    std::memcpy(moved, memory, std::min(old_bytes, new_bytes));
    free_pages(memory, old_bytes);
    return moved;
  }
#else
  (void)old_bytes;
#endif
  return checked(std::realloc(memory, new_bytes));
}

void free_pages(void* memory, std::size_t bytes) noexcept {
#ifdef __linux__
  if (bytes >= kMapFrom) {
    munmap(memory, bytes);
    return;
  }
#else
  (void)bytes;
#endif
  std::free(memory);
}

}  // namespace terrace::tri
