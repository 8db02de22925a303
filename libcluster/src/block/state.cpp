// SPDX-License-Identifier: Apache-2.0
#include "block/state.hpp"

#include <algorithm>
#include <cstring>
#include <new>
#include <utility>

namespace terrace::cluster {

template <class T>
Column<T>::~Column() {
  if (data_ != nullptr) ::operator delete (data_, std::align_val_t{64});
}

template <class T>
void Column<T>::reserve(std::size_t count, std::size_t preserved) {
  if (count <= capacity_) return;
  const std::size_t capacity =
      (std::max(count, capacity_ + capacity_ / 2) + kLanes - 1) / kLanes * kLanes;
  T* data = static_cast<T*>(::operator new (capacity * sizeof(T), std::align_val_t{64}));
  if (preserved > 0) std::memcpy(data, data_, preserved * sizeof(T));
  std::memset(data + preserved, 0, (capacity - preserved) * sizeof(T));
  if (data_ != nullptr) ::operator delete (data_, std::align_val_t{64});
  data_ = data;
  capacity_ = capacity;
}

template <class T>
void Column<T>::swap(Column& other) noexcept {
  std::swap(data_, other.data_);
  std::swap(capacity_, other.capacity_);
}

template class Column<float>;
template class Column<std::uint32_t>;

void BlockState::reserve_facilities(std::uint32_t facilities) {
  const std::size_t room = facilities + kLanes;
  if (room <= facility.capacity()) return;
  for (Column<std::uint32_t>* column : {&facility, &begin, &size, &nearby, &close_flag, &cursor}) {
    column->reserve(room, facility_count);
  }
  for (Column<float>* column : {&fx, &fy, &fz, &gain_range, &longest, &weight_sum, &connection_cost,
                                &mean_x, &mean_y, &mean_z, &scratch}) {
    column->reserve(room, facility_count);
  }
  for (std::size_t j = facility_count; j < room; ++j) {
    fx[j] = kFarAway;
    gain_range[j] = 0;
  }
}

std::uint32_t BlockState::add_facility(std::uint32_t point) {
  reserve_facilities(facility_count + 1);
  const std::uint32_t j = facility_count++;
  facility[j] = point;
  fx[j] = x[point];
  fy[j] = y[point];
  fz[j] = z[point];
  gain_range[j] = longest[j] = weight_sum[j] = connection_cost[j] = 0;
  size[j] = 0;
  // Fills the surplus lanes of the last vector.
  for (std::uint32_t k = facility_count; k < round_to_lanes(facility_count); ++k) {
    fx[k] = kFarAway;
    fy[k] = fz[k] = gain_range[k] = 0;
  }
  return j;
}

void BlockState::remove_facility(std::uint32_t j) {
  const std::uint32_t last = --facility_count;
  if (j != last) {
    for (Column<std::uint32_t>* column : {&facility, &begin, &size}) (*column)[j] = (*column)[last];
    for (Column<float>* column : {&fx, &fy, &fz, &gain_range, &longest, &weight_sum,
                                  &connection_cost, &mean_x, &mean_y, &mean_z}) {
      (*column)[j] = (*column)[last];
    }
  }
  fx[last] = kFarAway;
  gain_range[last] = 0;
}

void BlockState::reserve_pool(std::uint32_t extra) {
  if (pool_used + extra <= px.capacity()) return;
  std::uint32_t used = 0;
  for (std::uint32_t j = 0; j < facility_count; ++j) used += round_to_lanes(size[j]);
  // Leaves half of the pool free, so that compaction is rare.
  const std::size_t room = std::max<std::size_t>(px.capacity(), 2 * (std::size_t{used} + extra));
  Column<float>* columns[6] = {&px, &py, &pz, &pw, &pd, &pp};
  for (Column<float>& column : spare_) column.reserve(room);
  std::uint32_t end = 0;
  for (std::uint32_t j = 0; j < facility_count; ++j) {
    const std::uint32_t length = round_to_lanes(size[j]);
    for (int c = 0; c < 6; ++c) {
      if (length > 0) std::memcpy(spare_[c] + end, *columns[c] + begin[j], length * sizeof(float));
    }
    begin[j] = end;
    end += length;
  }
  for (int c = 0; c < 6; ++c) columns[c]->swap(spare_[c]);
  pool_used = end;
}

void BlockState::place_segments() {
  std::uint32_t number = 0;
  std::uint32_t end = 0;
  for (std::uint32_t j = 0; j < facility_count; ++j) {
    cursor[j] = end;
    // A facility has no clients if a facility with a lower number is at the same position.
    if (size[j] == 0) continue;
    facility[number] = facility[j];
    fx[number] = fx[j];
    fy[number] = fy[j];
    fz[number] = fz[j];
    begin[number] = end;
    end += round_to_lanes(size[j]) + kLanes;
    size[number++] = size[j];
  }
  for (std::uint32_t j = number; j < facility_count; ++j) {
    fx[j] = kFarAway;
    gain_range[j] = 0;
  }
  facility_count = number;
  for (Column<float>* column : {&px, &py, &pz, &pw, &pd, &pp})
    column->reserve(2 * std::size_t{end});
  pool_used = end;
}

void BlockState::check_now() {
  vectors_since_check = 0;
  if (*check_stop) (*check_stop)();
}

void BlockState::sort_facilities() {
  std::sort(static_cast<std::uint32_t*>(facility), facility + facility_count);
  for (std::uint32_t j = 0; j < facility_count; ++j) {
    const std::uint32_t point = facility[j];
    fx[j] = x[point];
    fy[j] = y[point];
    fz[j] = z[point];
  }
}

}  // namespace terrace::cluster
