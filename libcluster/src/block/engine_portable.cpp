// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdint>

#include "block/engine_impl.hpp"

/// Sixteen floats in plain C++. The types in engine_avx2.cpp and engine_avx512.cpp have the same
/// operations, and the results are equal to the last bit. That requires IEEE arithmetic without
/// contraction, a fixed reduction tree, and min and max that return the second operand on ties.

namespace terrace::cluster::simd {

struct Portable {
  struct Mask {
    std::uint32_t lanes;
    [[nodiscard]] std::uint32_t bits() const { return lanes; }
  };

  float v[16];

  template <class Function>
  static Portable each(Function function) {
    Portable r;
    for (int i = 0; i < 16; ++i) r.v[i] = function(i);
    return r;
  }
  template <class Function>
  static Mask each_bit(Function function) {
    std::uint32_t bits = 0;
    for (int i = 0; i < 16; ++i) bits |= (function(i) ? 1u : 0u) << i;
    return {bits};
  }

  static Portable load(const float* source) {
    return each([=](int i) { return source[i]; });
  }
  /// Loads integers from 0 to 2^24.
  static Portable load_integers(const std::uint32_t* source) {
    return each([=](int i) { return static_cast<float>(source[i]); });
  }
  static Portable broadcast(float value) {
    return each([=](int) { return value; });
  }
  /// Returns 0, 1, ... 15.
  static Portable iota() {
    return each([](int i) { return static_cast<float>(i); });
  }
  void store(float* target) const {
    for (int i = 0; i < 16; ++i) target[i] = v[i];
  }

  /// Stores integers from 0 to 2^24.
  void store_as_integers(std::uint32_t* target) const {
    for (int i = 0; i < 16; ++i) target[i] = static_cast<std::uint32_t>(v[i]);
  }

  friend Portable operator+(Portable a, Portable b) {
    return each([&](int i) { return a.v[i] + b.v[i]; });
  }
  friend Portable operator-(Portable a, Portable b) {
    return each([&](int i) { return a.v[i] - b.v[i]; });
  }
  friend Portable operator*(Portable a, Portable b) {
    return each([&](int i) { return a.v[i] * b.v[i]; });
  }
  friend Portable operator/(Portable a, Portable b) {
    return each([&](int i) { return a.v[i] / b.v[i]; });
  }
  friend Portable min(Portable a, Portable b) {
    return each([&](int i) { return a.v[i] < b.v[i] ? a.v[i] : b.v[i]; });
  }
  friend Portable max(Portable a, Portable b) {
    return each([&](int i) { return a.v[i] > b.v[i] ? a.v[i] : b.v[i]; });
  }
  friend Portable sqrt(Portable a) {
    return each([&](int i) { return std::sqrt(a.v[i]); });
  }
  friend Mask less(Portable a, Portable b) {
    return each_bit([&](int i) { return a.v[i] < b.v[i]; });
  }
  friend Mask equal(Portable a, Portable b) {
    return each_bit([&](int i) { return a.v[i] == b.v[i]; });
  }
  friend Mask operator&(Mask a, Mask b) { return {a.lanes & b.lanes}; }
  friend Mask operator~(Mask m) { return {~m.lanes & 0xffffu}; }
  /// Returns a where the mask is set and b elsewhere.
  friend Portable select(Mask m, Portable a, Portable b) {
    return each([&](int i) { return ((m.lanes >> i) & 1u) != 0 ? a.v[i] : b.v[i]; });
  }
  friend float sum(Portable a) {
    for (int half = 8; half > 0; half /= 2) {
      for (int i = 0; i < half; ++i) a.v[i] = a.v[i] + a.v[i + half];
    }
    return a.v[0];
  }
  friend float least(Portable a) {
    for (int half = 8; half > 0; half /= 2) {
      for (int i = 0; i < half; ++i) a.v[i] = a.v[i] < a.v[i + half] ? a.v[i] : a.v[i + half];
    }
    return a.v[0];
  }
  friend float largest(Portable a) {
    for (int half = 8; half > 0; half /= 2) {
      for (int i = 0; i < half; ++i) a.v[i] = a.v[i] > a.v[i + half] ? a.v[i] : a.v[i + half];
    }
    return a.v[0];
  }
  /// Stores the lanes of the mask densely. May write all of target[0 .. 15].
  friend void compress(float* target, Mask m, Portable a) {
    for (std::uint32_t remaining = m.lanes; remaining != 0; remaining &= remaining - 1) {
      *target++ = a.v[__builtin_ctz(remaining)];
    }
  }
};

}  // namespace terrace::cluster::simd

namespace terrace::cluster {

void run_engine_portable(BlockState& state, const SearchPlan& plan) {
  Engine<simd::Portable>(state).run(plan);
}

}  // namespace terrace::cluster
