// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "mesh.hpp"

namespace terrace::tri::tin::points {

/// The triangles around a new vertex, as sectors to which samples are assigned.
class Fan {
 public:
  /// `open`: the vertex is on the border, so there is one more ray than sectors.
  void start(const Vertex& apex, bool open);
  void add_ray(const Vertex& end);
  /// Must be called after the last ray.
  void finish();

  /// Assigns the samples of a list to sectors, except for `apart`.
  void deal(Sample* samples, std::uint32_t head, std::uint32_t apart);
  /// Terminates the sectors' lists.
  void close();

  struct Sector {
    std::uint32_t* end;  ///< the place of the link to the sector's next sample
    std::uint32_t head;
    /// sample of greatest error that is not stuck, kNone if there is none
    std::uint32_t worst;
    double error;
  };
  [[nodiscard]] const std::vector<Sector>& sectors() const { return sectors_; }

 private:
  [[nodiscard]] std::size_t sector_of(double dx, double dy) const;
  [[nodiscard]] std::size_t sector_of_many(double dx, double dy) const;
  [[nodiscard]] double height_without_plane(std::size_t sector, const Sample& sample) const;

  Vertex apex_{};
  bool open_ = false;
  std::vector<Vertex> rays_;  ///< end points of the rays
  std::size_t half_ = 0;      ///< the first ray at least 180 degrees to the left of ray 0
  /// Directions of the rays in pairs, padded with zeros: 2 x, 2 y.
  std::vector<double> pairs_;
  std::vector<Plane> planes_;  ///< by sector
  std::vector<Sector> sectors_;
};

}  // namespace terrace::tri::tin::points
