// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include "base/units.hpp"
#include "base/vector.hpp"
#include "tile/format/ellipsoid.hpp"
#include "tile/format/quantized_mesh.hpp"
#include "tile/make/sides.hpp"
#include "tile/verify/checks.hpp"

namespace terrace::terrain {
namespace {

using stream::Point3;

/// Tolerances of a header for rounding, in metres and as shares.
constexpr double kLengthSlack = 1e-3;
constexpr double kShareSlack = 1e-3;
constexpr std::uint64_t kLowestAt = 24, kHighestAt = 28, kSphereAt = 32, kHorizonAt = 64;

double distance(const Point3& a, const Point3& b) {
  const Point3 d{a[0] - b[0], a[1] - b[1], a[2] - b[2]};
  return std::sqrt(dot(d, d));
}

/// Returns the faults of a tile's header. It is sound if its heights are those of the lowest and
/// the highest vertex, the sphere contains all vertices and is not wider than its centre requires,
/// the centre is in the tile, and the horizon occlusion point is not hidden while a vertex is
/// visible, and not farther out than that requires. The tile must have a vertex. O(n).
std::vector<TileFault> check_tile_header(const TileAddress& address, const DecodedTile& tile) {
  std::vector<TileFault> faults;
  const auto fault = [&](std::uint64_t offset, std::string what) {
    faults.push_back({offset, std::move(what)});
  };
  const TileMesh& mesh = tile.mesh;
  std::vector<Point3> points;
  points.reserve(mesh.size());
  for (std::size_t i = 0; i < mesh.size(); ++i) {
    points.push_back(geocentric(longitude_at(address, mesh.u[i]), latitude_at(address, mesh.v[i]),
                                mesh.metres(i)));
  }
  const auto [low, high] = std::minmax_element(mesh.height.begin(), mesh.height.end());
  if (mesh.lowest<mesh.highest&& * low> 0) {
    fault(kLowestAt, "its lowest height is " +
                         readable_number(static_cast<double>(mesh.lowest), 6) +
                         " m, but no vertex has it");
  }
  if (mesh.lowest < mesh.highest && *high < kTileUnits) {
    fault(kHighestAt, "its highest height is " +
                          readable_number(static_cast<double>(mesh.highest), 6) +
                          " m, but no vertex has it");
  }
  const Sphere& sphere = tile.header.sphere;
  double farthest = 0.0;
  for (const Point3& p : points) farthest = std::max(farthest, distance(p, sphere.centre));
  if (farthest > sphere.radius + kLengthSlack) {
    fault(kSphereAt, "the bounding sphere leaves out vertices by up to " +
                         readable_number(farthest - sphere.radius) + " m");
  } else if (sphere.radius > farthest * (1.0 + kShareSlack) + kLengthSlack) {
    fault(kSphereAt + 24, "the bounding sphere is " + readable_number(sphere.radius / farthest) +
                              " times as wide as its centre requires");
  }
  if (distance(tile.header.centre, bounding_sphere(points).centre) >
      bounding_sphere(points).radius + kLengthSlack) {
    fault(0, "the centre is outside the sphere around the tile");
  }
  // The point may be in any direction; only its distance matters.
  const Point3& occlusion = tile.header.horizon_occlusion;
  const double length = std::sqrt(dot(occlusion, occlusion));
  const Point3 towards{occlusion[0] * kEquatorialRadius, occlusion[1] * kEquatorialRadius,
                       occlusion[2] * kPolarRadius};
  if (!(length > 0.0)) {
    fault(kHorizonAt, "the horizon occlusion point is the centre of the Earth");
    return faults;
  }
  const Point3 right = horizon_occlusion_point(towards, points);
  const double needed = std::sqrt(dot(right, right));
  constexpr int kDigits = 12;  // these numbers are slightly above 1
  if (length < needed * (1.0 - 1e-9)) {
    fault(kHorizonAt, "the horizon occlusion point is hidden while a vertex is not: it is " +
                          readable_number(length, kDigits) + " radii out, " +
                          readable_number(needed, kDigits) + " are needed");
  } else if (length > needed * (1.0 + kShareSlack)) {
    fault(kHorizonAt, "the horizon occlusion point is " + readable_number(length, kDigits) +
                          " radii out, " + readable_number(needed, kDigits) + " are needed");
  }
  return faults;
}

/// Tolerance for a normal's upward component: a normal has 2 x 8 bits.
constexpr double kNormalSlack = 0.02;

class MeshCheck {
 public:
  MeshCheck(const TileAddress& address, const DecodedTile& tile)
      : address_(address), tile_(tile), mesh_(tile.mesh) {
    const std::size_t n = mesh_.size();
    index_size_ = n > kMaxShortVertices ? 4 : 2;
    triangles_at_ = kVerticesAt + 4 + 6 * n;
    if (index_size_ == 4) triangles_at_ = (triangles_at_ + 3) / 4 * 4;
    edges_at_ = triangles_at_ + 4 + 3 * index_size_ * mesh_.triangles.size();
    extensions_at_ = edges_at_ + 16 +
                     index_size_ * (tile.edges.west.size() + tile.edges.south.size() +
                                    tile.edges.east.size() + tile.edges.north.size());
  }

  void triangles();
  void cover();
  void vertices();
  void edges();
  void normals();
  void extensions(const std::vector<std::string>& promised_names);

  std::vector<TileFault> faults;

 private:
  static constexpr std::uint64_t kVerticesAt = 88;

  void fault(std::uint64_t offset, std::string what) {
    faults.push_back({offset, std::move(what)});
  }
  [[nodiscard]] std::uint64_t triangle_at(std::size_t t) const {
    return triangles_at_ + 4 + 3 * index_size_ * t;
  }
  [[nodiscard]] std::int64_t twice_area(std::size_t t) const {
    const auto& [a, b, c] = mesh_.triangles[t];
    const auto u = [this](std::uint32_t v) { return std::int64_t{mesh_.u[v]}; };
    const auto v = [this](std::uint32_t w) { return std::int64_t{mesh_.v[w]}; };
    return (u(b) - u(a)) * (v(c) - v(a)) - (u(c) - u(a)) * (v(b) - v(a));
  }
  [[nodiscard]] bool on_border(std::uint32_t a, std::uint32_t b) const {
    const auto same = [&](const std::vector<std::uint16_t>& c) {
      return c[a] == c[b] && (c[a] == 0 || c[a] == kTileUnits);
    };
    return same(mesh_.u) || same(mesh_.v);
  }

  const TileAddress& address_;
  const DecodedTile& tile_;
  const TileMesh& mesh_;
  std::uint64_t index_size_ = 0, triangles_at_ = 0, edges_at_ = 0, extensions_at_ = 0;
};

/// Returns "triangle 5 ..." or "triangle 5 and 6 more ...".
std::string first_and_more(std::uint64_t count, const std::string& kind, std::uint64_t first,
                           const std::string& what) {
  if (count == 1) return fmt::format("{} {} {}", kind, first, what);
  return fmt::format("{} {} and {} more {}", kind, first, with_commas(count - 1), what);
}

void MeshCheck::triangles() {
  std::uint64_t turned = 0, empty = 0, first_turned = 0, first_empty = 0;
  std::int64_t sum = 0;
  for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
    const std::int64_t area = twice_area(t);
    sum += area;
    if (area < 0 && turned++ == 0) first_turned = t;
    if (area == 0 && empty++ == 0) first_empty = t;
  }
  if (turned > 0) {
    fault(triangle_at(first_turned), first_and_more(turned, "triangle", first_turned,
                                                    "not counter-clockwise as seen from above"));
  }
  if (empty > 0) {
    fault(triangle_at(first_empty), first_and_more(empty, "triangle", first_empty, "without area"));
  }
  constexpr std::int64_t kWhole = 2 * std::int64_t{kTileUnits} * kTileUnits;
  if (sum != kWhole) {
    fault(triangles_at_,
          "the triangles have " +
              readable_number(static_cast<double>(sum) / static_cast<double>(kWhole)) +
              " times the area of the tile");
  }
}

void MeshCheck::cover() {
  // Each directed edge may occur once, and must have its opposite unless it is on a border.
  // Together with the whole area and no inverted triangle, this means a cover without overlap.
  struct Edge {
    std::uint32_t low, high;
    bool forward;
    std::uint32_t triangle;
  };
  std::vector<Edge> edges;
  edges.reserve(3 * mesh_.triangles.size());
  for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
    for (unsigned k = 0; k < 3; ++k) {
      const std::uint32_t a = mesh_.triangles[t][k], b = mesh_.triangles[t][(k + 1) % 3];
      edges.push_back({std::min(a, b), std::max(a, b), a < b, t});
    }
  }
  std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
    if (a.low != b.low) return a.low < b.low;
    if (a.high != b.high) return a.high < b.high;
    return a.triangle < b.triangle;
  });
  std::uint64_t open = 0, crowded = 0;
  std::uint32_t first_open = 0, first_crowded = 0;
  for (std::size_t i = 0; i < edges.size();) {
    std::size_t end = i, forward = 0;
    for (; end < edges.size() && edges[end].low == edges[i].low && edges[end].high == edges[i].high;
         ++end) {
      forward += edges[end].forward ? 1 : 0;
    }
    const std::size_t count = end - i;
    const bool border = on_border(edges[i].low, edges[i].high);
    if (count == 1 && !border) {
      first_open = open++ == 0 ? edges[i].triangle : std::min(first_open, edges[i].triangle);
    } else if (count > 2 || (count == 2 && (border || forward != 1))) {
      first_crowded =
          crowded++ == 0 ? edges[i].triangle : std::min(first_crowded, edges[i].triangle);
    }
    i = end;
  }
  if (open > 0) {
    fault(triangle_at(first_open),
          fmt::format("{} only one triangle, the first at triangle {}",
                      counted(open, "edge", "inside the tile has", "inside the tile have"),
                      first_open));
  }
  if (crowded > 0) {
    fault(triangle_at(first_crowded),
          fmt::format("{} two triangles on one side, the first at triangle {}",
                      counted(crowded, "edge", "has", "have"), first_crowded));
  }
}

void MeshCheck::vertices() {
  std::vector<bool> used(mesh_.size());
  for (const auto& t : mesh_.triangles) {
    for (const std::uint32_t vertex : t) used[vertex] = true;
  }
  const auto unused = static_cast<std::uint64_t>(std::count(used.begin(), used.end(), false));
  if (unused > 0) {
    const auto first =
        static_cast<std::uint64_t>(std::find(used.begin(), used.end(), false) - used.begin());
    fault(kVerticesAt + 4 + 2 * first, first_and_more(unused, "vertex", first, "in no triangle"));
  }
  for (unsigned corner = 0; corner < 4; ++corner) {
    const std::uint16_t u = (corner & 1) != 0 ? kTileUnits : 0;
    const std::uint16_t v = (corner & 2) != 0 ? kTileUnits : 0;
    bool has_corner = false;
    for (std::size_t i = 0; i < mesh_.size() && !has_corner; ++i) {
      has_corner = mesh_.u[i] == u && mesh_.v[i] == v;
    }
    if (!has_corner) {
      fault(kVerticesAt, std::string("no vertex in the ") + (v == 0 ? "south-" : "north-") +
                             (u == 0 ? "west" : "east") + " corner");
    }
  }
}

void MeshCheck::edges() {
  const TileEdges expected = edges_of(mesh_);
  std::uint64_t at = edges_at_;
  const auto compare = [&](const char* name, std::vector<std::uint32_t> list,
                           std::vector<std::uint32_t> right) {
    if (list != right) {
      const std::uint64_t size = list.size();
      std::sort(list.begin(), list.end());
      std::sort(right.begin(), right.end());
      fault(at, std::string("the list of vertices on the ") + name + " side " +
                    (list == right ? "is not sorted along it"
                                   : "has " + counted(size, "entry") + " that are not its " +
                                         counted(right.size(), "vertex")));
    }
    at += 4 + index_size_ * list.size();
  };
  compare("west", tile_.edges.west, expected.west);
  compare("south", tile_.edges.south, expected.south);
  compare("east", tile_.edges.east, expected.east);
  compare("north", tile_.edges.north, expected.north);
}

void MeshCheck::normals() {
  std::uint64_t downward = 0, first = 0;
  for (std::size_t i = 0; i < mesh_.normals.size(); ++i) {
    const auto& n = mesh_.normals[i];
    const Point3 normal{static_cast<double>(n[0]), static_cast<double>(n[1]),
                        static_cast<double>(n[2])};
    const Point3 up =
        local_frame(longitude_at(address_, mesh_.u[i]), latitude_at(address_, mesh_.v[i])).up;
    // `!(x >= lo)` also rejects NaN.
    const bool good = std::abs(dot(normal, normal) - 1.0) < 1e-3 && dot(normal, up) > -kNormalSlack;
    if (!good && downward++ == 0) first = i;
  }
  if (downward > 0) {
    fault(extensions_at_,
          first_and_more(downward, "vertex", first, "with a normal that points downward"));
  }
}

void MeshCheck::extensions(const std::vector<std::string>& promised_names) {
  const auto compare = [&](const char* name, bool is_present) {
    const bool promised =
        std::find(promised_names.begin(), promised_names.end(), name) != promised_names.end();
    if (promised == is_present) return;
    fault(extensions_at_,
          std::string("the extension ") + name +
              (is_present ? " is not listed in layer.json" : " of layer.json is missing"));
  };
  compare("octvertexnormals", !mesh_.normals.empty());
  compare("watermask", !mesh_.water.empty());
  compare("metadata", !mesh_.metadata.empty());
  if (!mesh_.metadata.empty() && !nlohmann::json::accept(mesh_.metadata)) {
    fault(extensions_at_, "the metadata is not JSON");
  }
}

}  // namespace

std::vector<TileFault> check_tile_mesh(const TileAddress& address, const DecodedTile& tile,
                                       const std::vector<std::string>& extensions) {
  MeshCheck check(address, tile);
  if (tile.mesh.size() == 0) return {{88, "no vertex"}};
  check.faults = check_tile_header(address, tile);
  check.vertices();
  check.triangles();
  check.cover();
  check.edges();
  check.normals();
  check.extensions(extensions);
  return std::move(check.faults);
}

}  // namespace terrace::terrain
