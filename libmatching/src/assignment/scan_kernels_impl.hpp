// SPDX-License-Identifier: Apache-2.0
// The loops of scan_kernels.hpp over vectors of TERRACE_VECTOR_BYTES, for a file that is compiled
// for one instruction set. Everything is in an unnamed namespace and calls nothing outside it, so
// the rest of the program shares no code that needs a newer processor.
#pragma once

#include "assignment/scan_kernels.hpp"

namespace terrace::matching {
namespace {

constexpr std::size_t kLanes = TERRACE_VECTOR_BYTES / 8;

template <class Number>
struct Vector {
  typedef Number Type __attribute__((vector_size(TERRACE_VECTOR_BYTES)));
};
template <class Cost>
struct Packed {
  typedef Cost Type __attribute__((vector_size(kLanes * sizeof(Cost))));
};

template <class Number>
typename Vector<Number>::Type load(const Number* from) {
  typename Vector<Number>::Type v;
  __builtin_memcpy(&v, from, sizeof v);
  return v;
}

template <class Number>
void store(Number* to, const typename Vector<Number>::Type& v) {
  __builtin_memcpy(to, &v, sizeof v);
}

template <class Number, class Cost>
typename Vector<Number>::Type load_costs(const Cost* from) {
  typename Packed<Cost>::Type v;
  __builtin_memcpy(&v, from, sizeof v);
  return __builtin_convertvector(v, typename Vector<Number>::Type);
}

template <class Number>
typename Vector<Number>::Type all(Number value) {
  typename Vector<Number>::Type v;
  for (std::size_t k = 0; k < kLanes; ++k) v[k] = value;
  return v;
}

template <class Cost>
CostSum<Cost> relax(const Cost* costs, const CostSum<Cost>* labels, std::size_t columns,
                    CostSum<Cost> base, std::int64_t row, CostSum<Cost>* distance,
                    std::int64_t* previous, CostSum<Cost>* block_least) {
  using Sum = CostSum<Cost>;
  using V = typename Vector<Sum>::Type;
  const V bases = all(base);
  const auto rows = all(row);
  Sum least = kUnreachable<Sum>;
  for (std::size_t begin = 0; begin < columns; begin += kScanBlock) {
    const std::size_t end = begin + kScanBlock < columns ? begin + kScanBlock : columns;
    V lanes = all(kUnreachable<Sum>);
    std::size_t j = begin;
    for (; j + kLanes <= end; j += kLanes) {
      const V through = (bases + load_costs<Sum>(costs + j)) - load(labels + j);
      const V old_distance = load(distance + j);
      const auto nearer = through < old_distance;
      const V new_distance = nearer ? through : old_distance;
      store(distance + j, new_distance);
      store(previous + j, nearer ? rows : load(previous + j));
      lanes = new_distance < lanes ? new_distance : lanes;
    }
    Sum block = kUnreachable<Sum>;
    for (; j < end; ++j) {
      const Sum through = (base + static_cast<Sum>(costs[j])) - labels[j];
      if (through < distance[j]) {
        distance[j] = through;
        previous[j] = row;
      }
      block = distance[j] < block ? distance[j] : block;
    }
    for (std::size_t k = 0; k < kLanes; ++k) block = lanes[k] < block ? lanes[k] : block;
    block_least[begin / kScanBlock] = block;
    least = block < least ? block : least;
  }
  return least;
}

template <class Cost>
void least_two(const Cost* costs, const CostSum<Cost>* labels, std::size_t columns,
               CostSum<Cost>* first, CostSum<Cost>* second) {
  using Sum = CostSum<Cost>;
  using V = typename Vector<Sum>::Type;
  V first_lanes = all(kUnreachable<Sum>), second_lanes = first_lanes;
  std::size_t j = 0;
  for (; j + kLanes <= columns; j += kLanes) {
    const V value = load_costs<Sum>(costs + j) - load(labels + j);
    const auto below = value < first_lanes;
    const V other = below ? first_lanes : value;
    first_lanes = below ? value : first_lanes;
    second_lanes = other < second_lanes ? other : second_lanes;
  }
  Sum a = kUnreachable<Sum>, b = a;
  const auto take = [&](Sum value) {
    if (value < a) {
      b = a;
      a = value;
    } else if (value < b) {
      b = value;
    }
  };
  for (; j < columns; ++j) take(static_cast<Sum>(costs[j]) - labels[j]);
  for (std::size_t k = 0; k < kLanes; ++k) {
    take(first_lanes[k]);
    take(second_lanes[k]);
  }
  *first = a;
  *second = b;
}

}  // namespace
}  // namespace terrace::matching
