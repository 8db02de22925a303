// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "store/codec/coding.hpp"
#include "store/codec/predictor.hpp"

/// Codes clusters of a raster: their cells, as runs row by row, and the heights of the cells in
/// that order, each predicted from its neighbours in the cluster. A cluster does not depend on
/// others.
///
/// The functions are templates over SymbolEncoder and SymbolDecoder, so each serves both
/// directions.

namespace terrace::stream::store {

class GridCodec {
 public:
  /// Whether a cluster of n points in a box of this size may be coded as runs. In a larger box the
  /// cluster is so sparse that the k-d codec is smaller, and the raster would take too much memory.
  static bool fits(std::uint64_t width, std::uint64_t height, std::uint64_t n) {
    const std::uint64_t cells = 8 * n + 1024;
    return width <= cells && height <= cells && (width + kPadX) * (height + kPadY) <= cells;
  }

  /// For encoding: enters the points, as cells relative to the box. Returns false if two are in one
  /// cell.
  bool enter(std::uint32_t width, std::uint32_t height, const std::uint64_t* x,
             const std::uint64_t* y, const std::uint64_t* z, std::uint32_t n) {
    start(width, height);
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::size_t cell =
          cell_of(static_cast<std::uint32_t>(x[i]), static_cast<std::uint32_t>(y[i]));
      if (mask_[cell] != 0) return false;
      mask_[cell] = 1;
      values_[cell] = static_cast<std::int64_t>(z[i]);
      points_[cell] = i;
    }
    return true;
  }
  /// For encoding, after positions(): returns the point in the i-th coded cell.
  [[nodiscard]] std::uint32_t point(std::size_t i) const { return points_[cells_[i]]; }

  /// Codes the cells by rows and columns. Decoding fills x and y with n cells. borders: the first
  /// context of borders.
  template <class Coder>
  void positions(Coder& shared, unsigned borders, std::uint32_t width, std::uint32_t height,
                 std::uint32_t n, std::uint64_t* x, std::uint64_t* y) {
    typename Coder::Local coder = shared;
    if constexpr (Coder::kDecoding) start(width, height);
    cells_.resize(n);
    // Pointers, because the compiler must assume that writing a byte changes the vectors.
    std::uint32_t* const cells = cells_.data();
    [[maybe_unused]] std::uint8_t* const mask = mask_.data();
    std::uint32_t cell_count = 0;
    Border<false> left(borders, width);
    Border<true> right(borders, width);
    std::uint64_t runs_above = 0;
    bool row_above = false;
    for (std::uint32_t row = 0; row < height; ++row) {
      std::uint64_t runs = 0;
      if constexpr (!Coder::kDecoding) runs = count_runs(row);
      code_number(
          coder, context::kRunCount + static_cast<unsigned>(std::min<std::uint64_t>(runs_above, 2)),
          runs);
      std::uint64_t column = 0;
      for (std::uint64_t run = 0; run < runs; ++run) {
        std::uint64_t begin = 0, end = 0;
        if constexpr (!Coder::kDecoding) find_run(row, column, begin, end);
        if (run == 0) {
          const bool lower_half = 2 * row >= height;
          if (!row_above) {
            left.begin(coder, 0, begin);
            right.begin(coder, begin + 1, end);
          } else {
            left.move(coder, lower_half, begin);
            if (row + 1 < height || runs > 1) {
              right.move(coder, lower_half, end);
            } else if constexpr (Coder::kDecoding) {
              end = begin + (n - cell_count);  // all remaining cells
            }
          }
          row_above = true;
        } else {
          code_later_run(coder, width, column, begin, end);
        }
        if constexpr (Coder::kDecoding) {
          if (begin >= end || end > width || end - begin > n - cell_count) {
            throw Damage("a run is outside its cluster");
          }
        }
        auto cell = static_cast<std::uint32_t>(cell_of(static_cast<std::uint32_t>(begin), row));
        for (std::uint64_t c = begin; c < end; ++c, ++cell, ++cell_count) {
          cells[cell_count] = cell;
          if constexpr (Coder::kDecoding) {
            mask[cell] = 1;
            x[cell_count] = c;
            y[cell_count] = row;
          }
        }
        column = end;
      }
      runs_above = runs;
    }
    if (cell_count != n) throw Damage("a cluster has too few cells");
    if constexpr (Coder::kDecoding) shared = coder;
  }

  /// Codes the heights of the cells, in [0, size). Encoding takes them from enter(), decoding fills
  /// z.
  template <class Coder>
  void heights(Coder& shared, const Predictor& predictor, std::uint64_t size, std::uint64_t* z) {
    if (size == 1) {
      if constexpr (Coder::kDecoding) std::fill(z, z + cells_.size(), 0);
      return;
    }
    find_patterns();
    const auto max_height = static_cast<std::int64_t>(std::min<std::uint64_t>(size - 1, INT64_MAX));
    typename Coder::Local coder = shared;
    const std::ptrdiff_t up = stride_;
    std::int64_t last = max_height / 2;
    std::size_t i = 0;
    for (const std::uint32_t cell : cells_) {
      const unsigned pattern = patterns_[cell];
      std::int64_t* const at = values_.data() + cell;
      std::uint8_t* const magnitude = magnitudes_.data() + cell;

      std::int64_t predicted = last;
      if (pattern != 0) {
        const auto& c = predictor.coefficients[pattern];
        const auto term = [&](Neighbour n, std::int64_t value) {
          return static_cast<std::uint64_t>(static_cast<std::int64_t>(c[n])) *
                 static_cast<std::uint64_t>(value);
        };
        // Unsigned, because sums of extreme values wrap, in both directions alike.
        const std::uint64_t sum = term(kWest, at[-1]) + term(kNorth, at[-up]) +
                                  term(kNorthWest, at[-up - 1]) + term(kNorthEast, at[-up + 1]) +
                                  term(kWestWest, at[-2]) + term(kNorthNorth, at[-2 * up]);
        predicted = static_cast<std::int64_t>(sum + 128) >> 8;
      }
      predicted = std::clamp<std::int64_t>(predicted, 0, max_height);

      const unsigned near =
          2u * magnitude[-1] + 2u * magnitude[-up] + magnitude[-up - 1] + magnitude[-up + 1];
      const unsigned step =
          kStep[pattern].base +
          std::min<unsigned>((near * kStep[pattern].scale) >> 10, kStep[pattern].max_step);

      std::uint64_t residual = 0;
      if constexpr (!Coder::kDecoding) {
        residual = zigzag(static_cast<std::int64_t>(static_cast<std::uint64_t>(*at) -
                                                    static_cast<std::uint64_t>(predicted)));
      }
      const unsigned coded = code_number(coder, context::kHeight + step, residual);
      *magnitude = kMagnitude[coded];
      if constexpr (Coder::kDecoding) {
        const std::uint64_t value =
            static_cast<std::uint64_t>(predicted) + static_cast<std::uint64_t>(unzigzag(residual));
        *at = static_cast<std::int64_t>(value);
        z[i] = value;
      }
      last = *at;
      ++i;
    }
    if constexpr (Coder::kDecoding) shared = coder;
  }

  /// For training: adds the cells of positions() to the least squares.
  void fit(PredictorFit& sums);

 private:
  static constexpr std::uint32_t kPadX = 4, kPadY = 2;

  /// Codes a border of the first run of each row as the step outwards from the row above, in the
  /// context of the previous step and the distance to the side of the box. Both borders, mirrored,
  /// share contexts.
  template <bool kRight>
  class Border {
   public:
    /// Codes the left or right borders of runs. borders: as for positions().
    Border(unsigned borders, std::uint32_t width) : borders_(borders), width_(width) {}

    /// Codes the border in the first row that has cells.
    template <class Coder>
    void begin(Coder& coder, std::uint64_t lowest, std::uint64_t& value) {
      std::uint64_t number = value - lowest;
      code_number(coder, kRight ? context::kRunEnd : context::kRunStart, number);
      if (number > UINT32_MAX) throw Damage("a run is outside its cluster");
      value = lowest + number;
      at_ = static_cast<std::int64_t>(value);
    }
    template <class Coder>
    TERRACE_STORE_INLINE void move(Coder& coder, bool lower_half, std::uint64_t& value) {
      const std::int64_t room = kRight ? width_ - at_ : at_;
      const unsigned border_context =
          borders_ + (lower_half ? context::kBorders / 2 : 0) + last_ * context::kBorderRooms +
          static_cast<unsigned>(std::min<std::int64_t>(room, context::kBorderRooms - 1));
      const std::int64_t moved = static_cast<std::int64_t>(value) - at_;
      std::uint64_t number = zigzag(kRight ? moved : -moved);
      code_number(coder, border_context, number);
      if (number > 2ull * UINT32_MAX) throw Damage("a run is outside its cluster");
      const std::int64_t step = unzigzag(number);
      at_ += kRight ? step : -step;
      last_ = static_cast<unsigned>(std::clamp<std::int64_t>(step, -2, 2) + 2);
      value = static_cast<std::uint64_t>(at_);
    }

   private:
    unsigned borders_, last_ = 2;  ///< last_: the previous step + 2, 0 to 4
    std::uint32_t width_;
    std::int64_t at_ = 0;
  };

  /// How a pattern's neighbours form a context: by their mean magnitude. Cells with both W and N
  /// have separate contexts from those at the edges, which are predicted less well.
  struct Step {
    std::uint16_t scale = 0;
    std::uint8_t base = 0, max_step = 0;
  };
  static const std::array<Step, kPatterns> kStep;
  static const std::array<std::uint8_t, kSymbols> kMagnitude;

  /// Codes a run [begin, end) after another in its row, which ends before `column`.
  template <class Coder>
  TERRACE_STORE_INLINE static void code_later_run(Coder& coder, std::uint32_t width,
                                                  std::uint64_t column, std::uint64_t& begin,
                                                  std::uint64_t& end) {
    std::uint64_t gap = begin - column - 1, length = end - begin - 1;
    code_number(coder, context::kRunGap, gap);
    code_number(coder, context::kRunLength, length);
    if constexpr (Coder::kDecoding) {
      if (gap >= width || length >= width) throw Damage("a run is outside its cluster");
      begin = column + 1 + gap;
      end = begin + 1 + length;
    }
  }

  [[nodiscard]] std::size_t cell_of(std::uint32_t column, std::uint32_t row) const {
    return static_cast<std::size_t>(row + kPadY) * static_cast<std::size_t>(stride_) + column + 2;
  }
  void start(std::uint32_t width, std::uint32_t height);
  void find_patterns();
  [[nodiscard]] std::uint64_t count_runs(std::uint32_t row) const;
  void find_run(std::uint32_t row, std::uint64_t column, std::uint64_t& begin,
                std::uint64_t& end) const;

  std::ptrdiff_t stride_ = 0, rows_ = 0;  ///< with padding
  std::vector<std::uint8_t> mask_, patterns_, magnitudes_;
  std::vector<std::int64_t> values_;
  std::vector<std::uint32_t> points_, cells_;
};

}  // namespace terrace::stream::store
