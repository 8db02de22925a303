// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include <terrace/tri/delaunay2.hpp>

#include "base/available_memory.hpp"
#include "base/parallel.hpp"
#include "sample/samplers.hpp"
#include "surface/lattice_surface.hpp"
#include "surface/store_window.hpp"

namespace terrace::terrain {
namespace {

/// Places are handled tile by tile. A tile with few places is read in smaller pieces.
constexpr std::int64_t kTile = 256, kLatticePiece = 32;
constexpr std::size_t kFew = 100;
constexpr std::uint64_t kLatticeCacheBytes = std::uint64_t{4} << 20;
/// Memory of a thread: two readers with their clusters, and the heights of a tile.
constexpr std::uint64_t kWorkerBytes = std::uint64_t{20} << 20;

/// Natural neighbours of a place in the unit lattice are within two samples of its square, so a
/// block of the lattice slightly larger than the tile contains them all.
constexpr std::int64_t kNaturalTile = 56, kNaturalMargin = 4;
constexpr std::int64_t kBlock = kNaturalTile + 2 * kNaturalMargin;

/// Natural neighbours on a block of a raster. All places in the block share one triangulation.
class NaturalBlock {
 public:
  NaturalBlock(std::int64_t columns, std::int64_t rows)
      : columns_(std::min(columns, kBlock)), rows_(std::min(rows, kBlock)) {
    first_ = tri::slot(triangulation_.build_grid(0, 0, 1, static_cast<std::uint32_t>(columns_),
                                                 static_cast<std::uint32_t>(rows_)));
    heights_.resize(triangulation_.vertex_slots());
  }

  void answer(StoreWindow& reader, const LatticeWindow& raster, std::int64_t tile_column,
              std::int64_t tile_row, std::span<const Point2> places,
              std::span<const std::uint32_t> numbers, std::span<SurfacePoint> out) {
    const auto begin = [](std::int64_t tile, std::int64_t size, std::int64_t block) {
      return std::clamp<std::int64_t>(tile * kNaturalTile - kNaturalMargin, 0, size - block);
    };
    const LatticeWindow window{begin(tile_column, raster.columns, columns_),
                               begin(tile_row, raster.rows, rows_), columns_, rows_};
    reader.heights(window, std::span(heights_).subspan(first_, window.size()));
    // One by one: in a batch, the walk to a place, and so the last bit of its height, would depend
    // on the other places.
    for (const std::uint32_t i : numbers) {
      reader.query().store().check_stop();
      const std::array<tri::Point2, 1> place{
          tri::Point2{places[i][0] - static_cast<double>(window.column),
                      places[i][1] - static_cast<double>(window.row)}};
      const double height = tri::heights_at(triangulation_, heights_, place,
                                            tri::Interpolation::natural_neighbour, 1)[0];
      const tri::Gradient gradient = tri::gradients_at(triangulation_, heights_, place,
                                                       tri::GradientFrom::natural_neighbours, 1)[0];
      out[i] = {height, gradient.x, gradient.y};
    }
  }

 private:
  std::int64_t columns_, rows_;
  tri::Delaunay2<std::int32_t> triangulation_;
  std::size_t first_ = 0;
  std::vector<double> heights_;
};

/// The working data of one thread.
template <class T>
struct Worker {
  StoreWindow reader;  ///< for whole tiles, which do not overlap
  StoreWindow pieces;  ///< for small windows
  std::vector<T> heights{};
  std::optional<NaturalBlock> natural{};

  explicit Worker(const stream::Store& store) : reader(store), pieces(store, kLatticeCacheBytes) {}
};

/// T: the type that represents the heights exactly.
template <class T>
class LatticeSampler final : public HeightSampler {
 public:
  LatticeSampler(const stream::Store& store, const SamplerOptions& options, const Context& context)
      : store_(store),
        options_(options),
        stop_(context.stop),
        raster_{0, 0, static_cast<std::int64_t>(store.schema().columns),
                static_cast<std::int64_t>(store.schema().rows)},
        tile_(options.method == tri::Interpolation::natural_neighbour ? kNaturalTile : kTile),
        workers_(std::clamp<std::uint64_t>(working_memory(context) / 2 / kWorkerBytes, 1,
                                           std::max(1U, context.threads))) {}

  void sample(std::span<const Point2> places, std::span<SurfacePoint> out) override {
    std::fill(out.begin(), out.end(), SurfacePoint{});
    sort_by_tile(places);
    parallel_for(
        tiles_.size(), static_cast<unsigned>(workers_.size()),
        [&](std::size_t i, unsigned thread) {
          std::unique_ptr<Worker<T>>& worker = workers_[thread];
          if (worker == nullptr) worker = std::make_unique<Worker<T>>(store_);
          answer_tile(*worker, tiles_[i], places, out);
        },
        stop_);
  }

 private:
  struct Tile {
    std::uint64_t number = 0;
    std::size_t begin = 0, end = 0;  ///< range in order_
  };

  [[nodiscard]] bool nearest() const { return options_.method == tri::Interpolation::nearest; }

  /// Whether a place can have a height.
  [[nodiscard]] bool inside(const Point2& p) const {
    const double out = nearest() ? 0.5 : 0.0;
    const auto within = [out](double c, std::int64_t size) {
      return c >= -out && c <= static_cast<double>(size - 1) + out;
    };
    return within(p[0], raster_.columns) && within(p[1], raster_.rows);
  }
  [[nodiscard]] std::int64_t cell(double coordinate) const {
    return std::max<std::int64_t>(0, static_cast<std::int64_t>(std::floor(coordinate)));
  }

  /// Fills order_ with the numbers of the places inside, by tiles, and tiles_ with the tiles that
  /// have any. Within a tile the numbers are ascending.
  void sort_by_tile(std::span<const Point2> places) {
    const auto across = static_cast<std::uint64_t>((raster_.columns + tile_ - 1) / tile_);
    keyed_.clear();
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (!inside(places[i])) continue;
      const auto column = static_cast<std::uint64_t>(cell(places[i][0]) / tile_);
      const auto row = static_cast<std::uint64_t>(cell(places[i][1]) / tile_);
      keyed_.push_back({row * across + column, static_cast<std::uint32_t>(i)});
    }
    const auto tiles = across * static_cast<std::uint64_t>((raster_.rows + tile_ - 1) / tile_);
    order_.resize(keyed_.size());
    tiles_.clear();
    if (tiles <= 4 * places.size()) {
      // Counting sort is several times faster than comparisons.
      std::vector<std::uint32_t> next(tiles + 1, 0);
      for (const auto& [tile, i] : keyed_) ++next[tile + 1];
      for (std::uint64_t tile = 0; tile < tiles; ++tile) {
        next[tile + 1] += next[tile];
        if (next[tile + 1] > next[tile]) tiles_.push_back({tile, next[tile], next[tile + 1]});
      }
      for (const auto& [tile, i] : keyed_) order_[next[tile]++] = i;
      return;
    }
    std::sort(keyed_.begin(), keyed_.end());
    for (std::size_t k = 0; k < keyed_.size(); ++k) {
      if (tiles_.empty() || tiles_.back().number != keyed_[k].first) {
        tiles_.push_back({keyed_[k].first, k, k});
      }
      tiles_.back().end = k + 1;
      order_[k] = keyed_[k].second;
    }
  }

  void answer_tile(Worker<T>& worker, const Tile& tile, std::span<const Point2> places,
                   std::span<SurfacePoint> out) {
    const std::span<std::uint32_t> numbers(order_.data() + tile.begin, tile.end - tile.begin);
    if (options_.method == tri::Interpolation::natural_neighbour) {
      const auto across = static_cast<std::uint64_t>((raster_.columns + tile_ - 1) / tile_);
      if (!worker.natural) worker.natural.emplace(raster_.columns, raster_.rows);
      worker.natural->answer(worker.reader, raster_,
                             static_cast<std::int64_t>(tile.number % across),
                             static_cast<std::int64_t>(tile.number / across), places, numbers, out);
      return;
    }
    if (numbers.size() >= kFew) return answer_window(worker, worker.reader, numbers, places, out);
    const auto piece = [&](std::uint32_t i) {
      return std::pair(cell(places[i][1]) / kLatticePiece, cell(places[i][0]) / kLatticePiece);
    };
    std::sort(numbers.begin(), numbers.end(),
              [&](std::uint32_t a, std::uint32_t b) { return piece(a) < piece(b); });
    for (std::size_t begin = 0, end = 0; begin < numbers.size(); begin = end) {
      while (end < numbers.size() && piece(numbers[end]) == piece(numbers[begin])) ++end;
      answer_window(worker, worker.pieces, numbers.subspan(begin, end - begin), places, out);
    }
  }

  /// Reads the samples for the places, and one more on each side for gradients on samples.
  void answer_window(Worker<T>& worker, StoreWindow& reader, std::span<const std::uint32_t> numbers,
                     std::span<const Point2> places, std::span<SurfacePoint> out) {
    std::int64_t left = raster_.columns, top = raster_.rows, right = 0, bottom = 0;
    for (const std::uint32_t i : numbers) {
      const std::int64_t column = cell(places[i][0]), row = cell(places[i][1]);
      left = std::min(left, column);
      right = std::max(right, column);
      top = std::min(top, row);
      bottom = std::max(bottom, row);
    }
    // The nearest sample may be after the square, and its gradient uses one more.
    left = std::max<std::int64_t>(left - 1, 0);
    top = std::max<std::int64_t>(top - 1, 0);
    right = std::min(right + 2, raster_.columns - 1);
    bottom = std::min(bottom + 2, raster_.rows - 1);
    const LatticeWindow window{left, top, right - left + 1, bottom - top + 1};
    worker.heights.resize(window.size());
    reader.heights(window, std::span<T>(worker.heights));
    const LatticeView<T> view{worker.heights.data(), left, top, window.columns, window.rows};
    if (nearest()) {
      for (const std::uint32_t i : numbers) {
        out[i] = linear_at(view, nearest_sample(places[i][0], raster_.columns),
                           nearest_sample(places[i][1], raster_.rows));
      }
    } else {
      for (const std::uint32_t i : numbers) out[i] = linear_at(view, places[i][0], places[i][1]);
    }
  }

  static double nearest_sample(double coordinate, std::int64_t size) {
    return std::clamp(std::floor(coordinate + 0.5), 0.0, static_cast<double>(size - 1));
  }

  stream::Store store_;
  SamplerOptions options_;
  std::stop_token stop_;
  LatticeWindow raster_;
  std::int64_t tile_;
  std::vector<std::unique_ptr<Worker<T>>> workers_;
  std::vector<std::pair<std::uint64_t, std::uint32_t>> keyed_;
  std::vector<std::uint32_t> order_;
  std::vector<Tile> tiles_;
};

}  // namespace

std::unique_ptr<HeightSampler> make_lattice_sampler(const stream::Store& store,
                                                    const SamplerOptions& options,
                                                    const Context& context) {
  if (StoreWindow(store).float_is_exact()) {
    return std::make_unique<LatticeSampler<float>>(store, options, context);
  }
  return std::make_unique<LatticeSampler<double>>(store, options, context);
}

}  // namespace terrace::terrain
