// SPDX-License-Identifier: GPL-3.0-or-later
#include "sets.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "inputs.hpp"

namespace terrace::research {

namespace inputs = cluster::inputs;

namespace {

constexpr double kPi = 3.14159265358979323846;

/// SplitMix64 (Steele, Lea, Flood 2014). The seed of the k-th number is k steps away, so any number
/// can be computed without the previous ones.
class Hash {
 public:
  explicit Hash(std::uint64_t seed) : state_(seed) {}
  Hash(std::uint64_t seed, std::uint64_t index) : state_(seed ^ Hash(index).next()) {}
  std::uint64_t next() {
    std::uint64_t z = state_ += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }
  /// Returns a number that is uniform in [0, 1).
  double uniform() { return static_cast<double>(next() >> 11) * 0x1p-53; }
  std::uint64_t below(std::uint64_t bound) { return next() % bound; }

 private:
  std::uint64_t state_;
};

class Terrain final : public PointSet {
 public:
  Terrain(std::uint64_t size, double cell, double step, std::uint64_t seed)
      : PointSet(size), cell_(cell), step_(step), seed_(seed) {
    while (patches_across_ * patches_across_ * kPatchPoints < size) ++patches_across_;
  }

  void read(std::uint64_t first, std::span<Point3> points) override {
    for (Point3& p : points) p = point(first++);
  }

 private:
  static constexpr std::uint64_t kTile = 100, kTiles = 4, kSide = kTile * kTiles;
  static constexpr std::uint64_t kPatchPoints = kSide * kSide;

  Point3 point(std::uint64_t index) {
    const std::uint64_t patch = index / kPatchPoints;
    if (patch != patch_) {
      std::mt19937_64 random(Hash(seed_, patch).next());
      heights_ = inputs::fractal_heights(kSide, step_, random);
      patch_ = patch;
    }
    const std::uint64_t tile = index % kPatchPoints / (kTile * kTile);
    const std::uint64_t in_tile = index % (kTile * kTile);
    const std::uint64_t x = tile % kTiles * kTile + in_tile % kTile;
    const std::uint64_t y = tile / kTiles * kTile + in_tile / kTile;
    const double column = static_cast<double>(patch % patches_across_ * kSide + x);
    const double row = static_cast<double>(patch / patches_across_ * kSide + y);
    const double ground =
        60 * step_ *
        (std::sin(column / 700) * std::sin(row / 900) + 0.5 * std::sin((column + 2 * row) / 310));
    return {column * cell_, row * cell_, std::floor(ground + heights_[y * kSide + x] + 0.5)};
  }

  double cell_, step_;
  std::uint64_t seed_;
  std::uint64_t patches_across_ = 1;
  std::uint64_t patch_ = std::numeric_limits<std::uint64_t>::max();
  std::vector<double> heights_;
};

class Scan final : public PointSet {
 public:
  Scan(std::uint64_t size, std::uint64_t seed) : PointSet(size), seed_(seed) {
    rows_ = std::max<std::uint64_t>(
        1, static_cast<std::uint64_t>(std::sqrt(static_cast<double>(size) / 2)));
    per_ring_ = (size + rows_ - 1) / rows_;
    width_ = std::min<std::uint64_t>(500, (per_ring_ + 3) / 4);
  }

  void read(std::uint64_t first, std::span<Point3> points) override {
    for (Point3& p : points) p = point(first++);
  }

 private:
  [[nodiscard]] Point3 point(std::uint64_t index) const {
    const std::uint64_t swath = index / (width_ * rows_);
    // the last swath is narrower
    const std::uint64_t width = std::min(width_, per_ring_ - swath * width_);
    const std::uint64_t in_swath = index - swath * width_ * rows_;
    Hash random(seed_, index);
    const double u =
        static_cast<double>(swath * width_ + in_swath % width) + 0.3 * random.uniform();
    const double v = static_cast<double>(in_swath / width) + 0.3 * random.uniform();
    const double a = 2 * kPi * u / static_cast<double>(per_ring_);
    const double b = kPi * v / static_cast<double>(rows_);
    const double noise = random.uniform() + random.uniform() + random.uniform() - 1.5;
    const double r =
        1.0 + 0.1 * std::sin(5 * a) * std::sin(4 * b) + 0.03 * std::sin(23 * a + 17 * b);
    const double out = r + 0.001 * noise;
    return {out * std::sin(b) * std::cos(a), out * std::sin(b) * std::sin(a), out * std::cos(b)};
  }

  std::uint64_t seed_, rows_ = 0, per_ring_ = 0, width_ = 0;
};

class Plant final : public PointSet {
 public:
  Plant(std::uint64_t size, std::uint64_t seed) : PointSet(size), seed_(seed) {
    while (cells_across_ * cells_across_ * cells_across_ * kPipe * kPipes < size) ++cells_across_;
  }

  void read(std::uint64_t first, std::span<Point3> points) override {
    for (Point3& p : points) p = point(first++);
  }

 private:
  static constexpr std::uint64_t kRing = 12, kRings = 40, kPipe = kRing * kRings, kPipes = 64;

  [[nodiscard]] Point3 point(std::uint64_t index) const {
    const std::uint64_t pipe = index / kPipe;
    const std::uint64_t cell = pipe / kPipes;
    Hash random(seed_, pipe);
    const std::size_t along = random.below(3);
    const std::size_t u = (along + 1) % 3;
    const std::size_t v = (along + 2) % 3;
    Point3 start{random.uniform(), random.uniform(), random.uniform()};
    const double radius = 0.002 + 0.02 * random.uniform() * random.uniform();
    const double length = 0.1 + 0.9 * random.uniform();
    start[along] *= 1.0 - length;
    const double turn = 2 * kPi * static_cast<double>(index % kRing) / static_cast<double>(kRing);
    const double way = static_cast<double>(index % kPipe / kRing) / static_cast<double>(kRings - 1);
    Point3 p{static_cast<double>(cell % cells_across_),
             static_cast<double>(cell / cells_across_ % cells_across_),
             static_cast<double>(cell / cells_across_ / cells_across_)};
    p[along] += start[along] + way * length;
    p[u] += start[u] + radius * std::cos(turn);
    p[v] += start[v] + radius * std::sin(turn);
    return p;
  }

  std::uint64_t seed_;
  std::uint64_t cells_across_ = 1;
};

using Kind = NamedSet::Kind;

// Sizes are those of section 7.3.4. Where it gives only "million", two more digits are zeros. Cells
// and steps are in metres.
constexpr std::array<NamedSet, 8> kLarge{{{"Grand Canyon", 8'400'000, Kind::terrain, 60, 13},
                                          {"Puget Sound", 268'500'000, Kind::terrain, 10, 2.65},
                                          {"Earth", 309'400'000, Kind::terrain, 1000, 40},
                                          {"Lucy", 10'100'000, Kind::scan},
                                          {"Power Plant", 11'100'000, Kind::plant},
                                          {"David", 28'200'000, Kind::scan},
                                          {"St. Matthew", 187'000'000, Kind::scan},
                                          {"David (2011)", 468'600'000, Kind::scan}}};
constexpr std::array<NamedSet, 4> kSingle{{{"Bunny", 35'947, Kind::scan},
                                           {"Teapot", 80'203, Kind::scan},
                                           {"Crater", 100'001, Kind::terrain, 10, 2.65},
                                           {"Armadillo", 172'974, Kind::scan}}};

}  // namespace

std::unique_ptr<PointSet> make_terrain(std::uint64_t size, double cell, double step,
                                       std::uint64_t seed) {
  return std::make_unique<Terrain>(size, cell, step, seed);
}
std::unique_ptr<PointSet> make_scan(std::uint64_t size, std::uint64_t seed) {
  return std::make_unique<Scan>(size, seed);
}
std::unique_ptr<PointSet> make_plant(std::uint64_t size, std::uint64_t seed) {
  return std::make_unique<Plant>(size, seed);
}

std::vector<Point3> uniform_points(std::size_t count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<Point3> points(count, Point3{});
  for (Point3& p : points) {
    for (const std::size_t axis : {0u, 1u}) p[axis] = inputs::uniform(random);
  }
  return points;
}

std::string NamedSet::name() const {
  const char* const kinds[] = {"terrain", "scan", "plant"};
  return std::string(kinds[static_cast<std::size_t>(kind)]) + ", as " + std::string(thesis_name);
}

std::unique_ptr<PointSet> NamedSet::make(std::uint64_t size) const {
  const std::uint64_t seed = Hash(thesis_points).next();
  switch (kind) {
    case Kind::terrain:
      return make_terrain(size, cell, step, seed);
    case Kind::scan:
      return make_scan(size, seed);
    case Kind::plant:
      break;
  }
  return make_plant(size, seed);
}

std::span<const NamedSet> large_sets() { return kLarge; }
std::span<const NamedSet> single_sets() { return kSingle; }

}  // namespace terrace::research
