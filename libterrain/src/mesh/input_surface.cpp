// SPDX-License-Identifier: Apache-2.0
// The triangles of a mesh over the points that a store has of it.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <tuple>
#include <vector>

#include <terrace/stream/error.hpp>
#include <terrace/stream/stored_surface.hpp>

#include "base/store_checks.hpp"
#include "base/units.hpp"
#include "mesh/scan_surface_steps.hpp"

namespace terrace::terrain {
namespace {

/// Peak memory in bytes per triangle beyond two for each point.
constexpr std::uint64_t kBytesPerMoreTriangle = 200;

/// Finds the points of a store by their places.
class PlaceNumbers {
 public:
  explicit PlaceNumbers(const TriangleMesh& points) {
    entries_.reserve(points.positions.size());
    for (std::uint32_t number = 0; number < points.positions.size(); ++number) {
      entries_.push_back({points.positions[number], number});
    }
    const auto before = [&](const Entry& a, const Entry& b) {
      const unsigned level_a = points.levels[a.number], level_b = points.levels[b.number];
      return std::tie(a.place, level_b, a.number) < std::tie(b.place, level_a, b.number);
    };
    std::sort(entries_.begin(), entries_.end(), before);
    const auto same_place = [](const Entry& a, const Entry& b) { return a.place == b.place; };
    entries_.erase(std::unique(entries_.begin(), entries_.end(), same_place), entries_.end());
  }

  /// Returns stream::kNoNumber if no point has this place.
  [[nodiscard]] std::uint32_t operator[](const stream::Point3& place) const {
    const auto at = std::lower_bound(
        entries_.begin(), entries_.end(), place,
        [](const Entry& entry, const stream::Point3& p) { return entry.place < p; });
    return at != entries_.end() && at->place == place ? at->number : stream::kNoNumber;
  }

 private:
  struct Entry {
    stream::Point3 place;
    std::uint32_t number;
  };
  std::vector<Entry> entries_;
};

/// Counts the triangles that are left out.
struct LeftOut {
  std::uint64_t degenerate = 0, unselected = 0;

  void note(const Context& context) const {
    const auto say = [&](std::uint64_t count, const std::string& reason) {
      if (count == 0) return;
      context.say(counted(count, "triangle", "has", "have") + reason +
                  (count == 1 ? " and is" : " and are") + " left out of the surface");
    };
    say(degenerate, " two corners at one place");
    say(unselected, " a corner that was not selected");
  }
};

std::vector<std::array<std::uint32_t, 3>> numbered_faces(const stream::Store& store,
                                                         const TriangleMesh& points,
                                                         const InputTriangles& triangles,
                                                         const Context& context) {
  const PlaceNumbers numbers(points);
  std::vector<std::array<std::uint32_t, 3>> faces;
  LeftOut left_out;
  for (std::vector<InputTriangles::Triangle> block; triangles.next(block);) {
    context.check_stop();
    for (const InputTriangles::Triangle& triangle : block) {
      std::array<std::uint32_t, 3> face{};
      for (std::size_t k = 0; k < 3; ++k) {
        face[k] = numbers[world_point(store.schema(), triangle[k])];
      }
      if (std::find(face.begin(), face.end(), stream::kNoNumber) != face.end()) {
        if (!triangles.selected) {
          throw stream::Error(store.path().string(),
                              "a corner of a triangle is not a point of the store")
              .remedy("the input changed while it was read: build the store again");
        }
        ++left_out.unselected;
      } else if (face[0] == face[1] || face[1] == face[2] || face[2] == face[0]) {
        ++left_out.degenerate;
      } else {
        faces.push_back(face);
      }
    }
    const std::uint64_t count = points.positions.size(), usual = 2 * count;
    if (faces.size() <= usual) continue;
    const std::uint64_t more = (faces.size() - usual) * kBytesPerMoreTriangle / count + 1;
    need_memory_for_surface(store, count, kInputSurfaceBytesPerPoint + more, context.memory_or(0),
                            stream::message("raise {memory_bytes}, or leave the surface out"));
  }
  left_out.note(context);
  if (faces.empty() && left_out.degenerate + left_out.unselected > 0) {
    throw stream::Error(store.path().string(), "no triangle of the input is left for a surface")
        .remedy(stream::message(
            "select more points, or restore a surface from them: {surface_from} restored"));
  }
  return faces;
}

}  // namespace

tri::RestoredSurface input_surface(const stream::Store& store, const TriangleMesh& points,
                                   const InputTriangles& triangles, const Context& context) {
  tri::RestoredSurface out;
  out.surface.faces = numbered_faces(store, points, triangles, context);
  std::vector<std::uint32_t> vertex(points.positions.size(), stream::kNoNumber);
  for (const auto& face : out.surface.faces) {
    for (const std::uint32_t corner : face) vertex[corner] = 0;
  }
  const std::vector<stream::Point3> ground = on_ground(points.positions, store.schema());
  for (std::size_t number = 0; number < vertex.size(); ++number) {
    if (vertex[number] == stream::kNoNumber) continue;
    vertex[number] = static_cast<std::uint32_t>(out.input.size());
    out.input.push_back(number);
    out.surface.points.push_back(ground[number]);
  }
  for (auto& face : out.surface.faces) {
    for (std::uint32_t& corner : face) corner = vertex[corner];
  }
  return out;
}

}  // namespace terrace::terrain
