// SPDX-License-Identifier: Apache-2.0
// Stores of meshes whose surface has the triangles of the mesh.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <terrace/stream/error.hpp>
#include <terrace/stream/store.hpp>

#include "temporary_folder.hpp"
#include "terrace/terrain/build.hpp"
#include "terrace/terrain/scan_surface.hpp"

namespace terrace::terrain {
namespace {

constexpr int kMeshRounds = 24 / TERRACE_TEST_SHARE;

using MeshTriangle = InputTriangles::Triangle;

struct PolygonMesh {
  std::vector<stream::Point3> vertices;
  std::vector<std::vector<std::uint32_t>> faces;
};

/// Cuts faces into fans and turns each triangle so that its least corner is first; sorts them.
/// Leaves out triangles with two equal corners.
std::vector<MeshTriangle> sorted_triangles(const std::vector<stream::Point3>& vertices,
                                           const auto& faces) {
  std::vector<MeshTriangle> out;
  for (const auto& face : faces) {
    for (std::size_t k = 2; k < face.size(); ++k) {
      MeshTriangle t{vertices[face[0]], vertices[face[k - 1]], vertices[face[k]]};
      if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
      std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
      out.push_back(t);
    }
  }
  std::sort(out.begin(), out.end());
  return out;
}

/// A torus of quadrilaterals.
PolygonMesh torus_mesh() {
  constexpr std::uint32_t kAround = 48, kAcross = 20;
  PolygonMesh mesh;
  for (std::uint32_t i = 0; i < kAround; ++i) {
    for (std::uint32_t k = 0; k < kAcross; ++k) {
      const double u = 2.0 * std::numbers::pi * i / kAround;
      const double v = 2.0 * std::numbers::pi * k / kAcross;
      const double r = 10.0 + 3.0 * std::cos(v);
      mesh.vertices.push_back({r * std::cos(u), r * std::sin(u), 3.0 * std::sin(v)});
      const std::uint32_t next_i = (i + 1) % kAround, next_k = (k + 1) % kAcross;
      mesh.faces.push_back(
          {i * kAcross + k, next_i * kAcross + k, next_i * kAcross + next_k, i * kAcross + next_k});
    }
  }
  return mesh;
}

/// Whether each edge has an even number of triangles.
bool edges_are_even(const TriangleMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const auto& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) ++edges[std::minmax(t[k], t[(k + 1) % 3])];
  }
  return std::all_of(edges.begin(), edges.end(),
                     [](const auto& edge) { return edge.second % 2 == 0; });
}

class InputSurface : public ::testing::Test {
 protected:
  std::string put(const PolygonMesh& mesh, const std::string& name = "mesh.obj") {
    std::ofstream file(folder_.path() / name);
    file.precision(17);
    for (const auto& v : mesh.vertices) file << "v " << v[0] << ' ' << v[1] << ' ' << v[2] << '\n';
    for (const auto& face : mesh.faces) {
      file << 'f';
      for (const std::uint32_t corner : face) file << ' ' << corner + 1;
      file << '\n';
    }
    return (folder_.path() / name).string();
  }

  BuildRequest request(std::vector<std::string> inputs) {
    BuildRequest request;
    request.inputs = std::move(inputs);
    request.store = folder_.path() / "store";
    request.replace = true;
    request.block_points = 100;
    request.surface = [this](const stream::Store& store, const stream::ClusterOrder& order,
                             const InputTriangles& triangles) {
      return surface_to_store(store, order, context_, triangles);
    };
    return request;
  }

  stream::Store build(const BuildRequest& request) {
    notes_.clear();
    outcome_ = build_store(request, context_);
    return stream::Store::open(request.store);
  }

  /// Returns the cause of the error that a build throws, or an empty text.
  std::string error_of(const BuildRequest& request) {
    try {
      (void)build(request);
    } catch (const stream::Error& error) {
      return error.parts().cause.text();
    }
    return "";
  }

  tests::TemporaryFolder folder_;
  std::string notes_;
  Context context_{.note = [this](const stream::Message& note) { notes_ += note.text() + '\n'; }};
  BuildOutcome outcome_;
};

TEST_F(InputSurface, HasTheTrianglesOfAnySoup) {
  for (int round = 0; round < kMeshRounds; ++round) {
    const auto seed = static_cast<std::uint64_t>(round);
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937_64 random(seed);
    // Coincident vertices, edges of many triangles, equal triangles, and points without triangles.
    PolygonMesh mesh;
    const std::uint64_t vertices = 3 + random() % 300, side = 2 + random() % 8;
    for (std::uint64_t i = 0; i < vertices; ++i) {
      stream::Point3 p{};
      for (double& x : p) x = 0.1 * static_cast<double>(random() % side) - 0.2;
      mesh.vertices.push_back(p);
    }
    for (std::uint64_t faces = 1 + random() % 500; faces > 0; --faces) {
      std::vector<std::uint32_t>& face = mesh.faces.emplace_back();
      for (std::uint64_t k = 3 + random() % 3; k > 0; --k) {
        face.push_back(static_cast<std::uint32_t>(random() % vertices));
      }
    }
    const std::vector<MeshTriangle> expected = sorted_triangles(mesh.vertices, mesh.faces);
    if (expected.empty()) continue;
    const ScanSurface surface = scan_surface(build(request({put(mesh)})), {});
    EXPECT_TRUE(surface.stored);
    EXPECT_EQ(sorted_triangles(surface.mesh.positions, surface.mesh.triangles), expected);
    EXPECT_EQ(outcome_.surface->triangles, expected.size());
    std::size_t given = 0;
    for (const auto& face : mesh.faces) given += face.size() - 2;
    EXPECT_EQ(outcome_.input_triangles, given);
    EXPECT_EQ(notes_.find("two corners at one place") != std::string::npos,
              given > expected.size());
  }
}

TEST_F(InputSurface, CutsOfATorusAreClosed) {
  const PolygonMesh mesh = torus_mesh();
  const stream::Store store = build(request({put(mesh)}));
  ASSERT_GE(store.levels().size(), 2U);
  const ScanSurface full = scan_surface(store, {});
  EXPECT_EQ(sorted_triangles(full.mesh.positions, full.mesh.triangles),
            sorted_triangles(mesh.vertices, mesh.faces));
  EXPECT_TRUE(full.measures.closed);
  EXPECT_EQ(full.measures.euler_characteristic, 0);
  EXPECT_EQ(full.samples_off, 0U);
  EXPECT_GT(full.measures.volume, 0.0);
  const ScanSurface light = scan_surface(store, {}, {.max_error = 0.5});
  EXPECT_LT(light.mesh.triangles.size(), full.mesh.triangles.size());
  EXPECT_TRUE(light.measures.closed);
  EXPECT_EQ(light.measures.euler_characteristic, 0);
  EXPECT_TRUE(edges_are_even(scan_surface(store, {.level = 1}).mesh));
  std::mt19937_64 random(7);
  for (int round = 0; round < kMeshRounds; ++round) {
    Detail detail{.level = 1};
    std::string box;
    for (const int side : {0, 1}) {
      for (int axis = 0; axis < 3; ++axis) {
        const auto length = static_cast<int>(random() % 13);
        box += (box.empty() ? "" : ",") + std::to_string(side == 0 ? -length : length);
      }
    }
    detail.focuses.push_back({.region = Region::parse(box), .level = 0});
    EXPECT_TRUE(edges_are_even(scan_surface(store, detail).mesh)) << "round " << round;
  }
}

TEST_F(InputSurface, OriginIsChosen) {
  const std::string file = put(torus_mesh());
  BuildRequest restored = request({file});
  restored.surface_origin = SurfaceOrigin::restored;
  (void)build(restored);
  EXPECT_EQ(outcome_.input_triangles, 0U);
  BuildRequest input = request({file});
  input.surface_origin = SurfaceOrigin::input;
  (void)build(input);
  EXPECT_EQ(outcome_.input_triangles, 1920U);
  // Without faces, the surface is restored unless triangles are required.
  const std::string cloud = put({.vertices = torus_mesh().vertices, .faces = {}}, "cloud.obj");
  (void)build(request({cloud}));
  EXPECT_EQ(outcome_.input_triangles, 0U);
  EXPECT_TRUE(outcome_.surface);
  input.inputs = {cloud};
  EXPECT_NE(error_of(input).find("no triangles"), std::string::npos);
  std::ofstream(folder_.path() / "cloud.xyz") << "0 0 0\n1 0 0\n0 1 0\n0 0 1\n";
  input.inputs = {(folder_.path() / "cloud.xyz").string()};
  EXPECT_NE(error_of(input).find("no triangles"), std::string::npos);
}

TEST_F(InputSurface, FilesJoinWhereTheirVerticesCoincide) {
  const PolygonMesh mesh = torus_mesh();
  PolygonMesh half = mesh, other = mesh;
  const auto middle = static_cast<std::ptrdiff_t>(mesh.faces.size() / 2);
  half.faces.erase(half.faces.begin() + middle, half.faces.end());
  other.faces.erase(other.faces.begin(), other.faces.begin() + middle);
  const PolygonMesh cloud{.vertices = {{0, 0, 0}, {1, 1, 1}}, .faces = {}};
  const stream::Store store =
      build(request({put(half, "a.obj"), put(other, "b.obj"), put(cloud, "c.obj")}));
  const ScanSurface surface = scan_surface(store, {});
  EXPECT_EQ(sorted_triangles(surface.mesh.positions, surface.mesh.triangles),
            sorted_triangles(mesh.vertices, mesh.faces));
  EXPECT_TRUE(surface.measures.closed);
  EXPECT_EQ(surface.samples_off, 2U);
}

TEST_F(InputSurface, TrianglesWithUnselectedCornersAreLeftOut) {
  BuildRequest selected = request({put(torus_mesh())});
  selected.selection.region = stream::Box3{{0.5, -99, -99}, {99, 99, 99}};
  const ScanSurface surface = scan_surface(build(selected), {});
  const PolygonMesh mesh = torus_mesh();
  std::vector<MeshTriangle> expected = sorted_triangles(mesh.vertices, mesh.faces);
  std::erase_if(expected, [](const MeshTriangle& t) {
    return std::any_of(t.begin(), t.end(), [](const stream::Point3& p) { return p[0] < 0.5; });
  });
  EXPECT_EQ(sorted_triangles(surface.mesh.positions, surface.mesh.triangles), expected);
  EXPECT_TRUE(surface.open);
  EXPECT_NE(notes_.find("not selected"), std::string::npos);
  selected.selection.region = stream::Box3{{12.5, -0.1, -0.1}, {99, 0.1, 0.1}};
  EXPECT_NE(error_of(selected).find("no triangle"), std::string::npos);
}

TEST_F(InputSurface, MemoryForTrianglesIsBounded) {
  PolygonMesh mesh{.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, .faces = {}};
  for (int i = 0; i < 200'000; ++i) mesh.faces.push_back({0, 1, 2});
  BuildRequest hostile = request({put(mesh)});
  Context small = context_;
  small.memory_bytes = std::uint64_t{64} << 20;
  hostile.surface = [&](const stream::Store& store, const stream::ClusterOrder& order,
                        const InputTriangles& triangles) {
    return surface_to_store(store, order, small, triangles);
  };
  EXPECT_NE(error_of(hostile).find("needs"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(hostile.store));
}

}  // namespace
}  // namespace terrace::terrain
