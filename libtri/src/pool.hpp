// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <utility>

/// Growing arrays of plain data for the triangulation. Unlike std::vector they leave new elements
/// uninitialised. Large arrays grow by an eighth, moving pages instead of copying them where the
/// system can. They use huge pages, which are a sixth faster because accesses are scattered.

namespace terrace::tri {

inline constexpr std::size_t kHugePage = std::size_t{2} << 20;

/// Allocates at least `bytes` bytes. Throws std::bad_alloc.
void* allocate_pages(std::size_t bytes);
/// Moves `old_bytes` bytes of contents to `new_bytes` bytes of memory. Throws std::bad_alloc, which
/// leaves the old memory valid.
void* resize_pages(void* memory, std::size_t old_bytes, std::size_t new_bytes);
/// Frees memory of allocate_pages() or resize_pages().
void free_pages(void* memory, std::size_t bytes) noexcept;

template <class T>
class Pool {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  Pool() = default;
  Pool(Pool&& other) noexcept
      : data_(std::exchange(other.data_, nullptr)),
        size_(std::exchange(other.size_, 0)),
        capacity_(std::exchange(other.capacity_, 0)) {}
  Pool& operator=(Pool&& other) noexcept {
    Pool moved(std::move(other));
    std::swap(data_, moved.data_);
    std::swap(size_, moved.size_);
    std::swap(capacity_, moved.capacity_);
    return *this;
  }
  ~Pool() { release(); }

  [[nodiscard]] std::uint32_t size() const { return size_; }
  [[nodiscard]] std::size_t bytes() const { return capacity_ * sizeof(T); }
  [[nodiscard]] T* data() { return data_; }
  [[nodiscard]] const T* data() const { return data_; }
  T& operator[](std::uint32_t i) {
    assert(i < size_);
    return data_[i];
  }
  const T& operator[](std::uint32_t i) const {
    assert(i < size_);
    return data_[i];
  }

  void reserve(std::size_t count) {
    if (count > capacity_) set_capacity(count);
  }
  /// Changes the size. New elements are not initialised.
  void resize(std::uint32_t count) {
    if (count > capacity_) set_capacity(std::max<std::size_t>(count, next_capacity()));
    size_ = count;
  }
  void push_back(const T& value) {
    if (size_ == capacity_) set_capacity(next_capacity());
    data_[size_++] = value;
  }
  void release() noexcept {
    if (data_ != nullptr) free_pages(data_, bytes());
    data_ = nullptr;
    size_ = 0;
    capacity_ = 0;
  }

 private:
  [[nodiscard]] std::size_t next_capacity() const {
    // Growing below a huge page copies the array, so double it.
    const std::size_t doubled = 2 * capacity_ + 16;
    if (doubled * sizeof(T) < kHugePage) return doubled;
    // Grow by whole huge pages, because memory that was touched as small pages never becomes a huge
    // page.
    const std::size_t grown = capacity_ + capacity_ / 8;
    const std::size_t whole_pages = grown * sizeof(T) / kHugePage * kHugePage / sizeof(T);
    return whole_pages > capacity_ ? whole_pages : whole_pages + kHugePage / sizeof(T);
  }
  void set_capacity(std::size_t count) {
    void* moved = data_ == nullptr ? allocate_pages(count * sizeof(T))
                                   : resize_pages(data_, bytes(), count * sizeof(T));
    data_ = static_cast<T*>(moved);
    capacity_ = count;
  }

  T* data_ = nullptr;
  std::uint32_t size_ = 0;
  std::size_t capacity_ = 0;
};

template <class T>
std::span<T> span_of(Pool<T>& pool) {
  return {pool.data(), pool.size()};
}
template <class T>
std::span<const T> span_of(const Pool<T>& pool) {
  return {pool.data(), pool.size()};
}

}  // namespace terrace::tri
