// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "mesh.hpp"

namespace terrace::tri::tin::points {

/// The triangles around a new vertex, as sectors that samples are dealt to.
class Fan {
 public:
  /// `open`: the vertex lies on the border, so there is one ray more than sectors.
  void start(const Vertex& apex, bool open);
  void add_ray(const Vertex& end);
  /// All rays are there.
  void finish();

  /// Deals the samples of a list, `apart` left out.
  void deal(Sample* samples, std::uint32_t head, std::uint32_t apart);
  /// Ends the sectors' lists.
  void close();

  struct Sector {
    std::uint32_t* end;  ///< the `next` that the sector's next sample goes to
    std::uint32_t head;
    std::uint32_t worst;  ///< of greatest error, kNone: none has any; stuck ones do not count
    double error;
  };
  [[nodiscard]] const std::vector<Sector>& sectors() const { return sectors_; }

 private:
  [[nodiscard]] std::size_t sector_of(double dx, double dy) const;
  [[nodiscard]] std::size_t sector_of_many(double dx, double dy) const;
  [[nodiscard]] double height_without_plane(std::size_t sector, const Sample& sample) const;

  Vertex apex_{};
  bool open_ = false;
  std::vector<Vertex> rays_;  ///< their ends
  /// Directions of the rays in pairs, filled up with zeros: 2 x, 2 y.
  std::vector<double> pairs_;
  std::vector<Plane> planes_;  ///< of the sectors
  std::vector<Sector> sectors_;
};

}  // namespace terrace::tri::tin::points
