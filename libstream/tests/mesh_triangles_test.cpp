// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <fstream>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "temp_folder.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/mesh_reader.hpp"
#include "terrace/stream/mesh_writer.hpp"
#include "terrace/stream/source.hpp"

/// Entities::triangles compared with read_mesh(), which holds the mesh in memory.

namespace terrace::stream {
namespace {

using Corners = std::array<Point3, 3>;

class MeshTriangles : public ::testing::Test {
 protected:
  std::string put(const std::string& name, const std::string& content) {
    std::ofstream(folder_.path() / name, std::ios::binary) << content;
    return (folder_.path() / name).string();
  }

  static SourceOptions options(std::size_t block_points = 1000) {
    SourceOptions options;
    options.entities = Entities::triangles;
    options.block_points = block_points;
    return options;
  }

  static std::vector<Corners> triangles_of(const std::vector<std::string>& files,
                                           std::size_t block_points) {
    const auto source = open_source(files, options(block_points));
    const SourceInfo& info = source->info();
    EXPECT_EQ(info.attributes.size(), 6u);
    const bool narrow = info.attributes[0].type == ScalarType::f32;
    std::vector<Corners> triangles;
    for (PointBlock block; source->next(block);) {
      EXPECT_LE(block.size(), block_points);
      EXPECT_EQ(block.payload.size(), block.size() * info.payload_size());
      for (std::size_t i = 0; i < block.size(); ++i) {
        Corners corners{block.positions[i]};
        for (std::size_t a = 0; a < 6; ++a) {
          EXPECT_EQ(info.attributes[a].name,
                    std::string(1, "xyz"[a % 3]) + std::to_string(2 + a / 3));
          corners[1 + a / 3][a % 3] =
              narrow ? static_cast<double>(info.view<float>(block.payload, a)[i])
                     : info.view<double>(block.payload, a)[i];
        }
        triangles.push_back(corners);
      }
    }
    EXPECT_EQ(source->progress().points, triangles.size());
    return triangles;
  }

  static std::vector<Corners> in_memory(const std::string& file) {
    const auto mesh = read_mesh(file);
    std::vector<Corners> triangles;
    for (const TriangleIndices& t : mesh->triangles) {
      const auto& places = mesh->vertices.positions;
      triangles.push_back({places[t[0]], places[t[1]], places[t[2]]});
    }
    return triangles;
  }

  static bool same_bits(const std::vector<Corners>& a, const std::vector<Corners>& b) {
    const auto bits = [](double x) { return std::bit_cast<std::uint64_t>(x); };
    return a.size() == b.size() &&
           std::equal(a.begin(), a.end(), b.begin(), [&](const Corners& s, const Corners& t) {
             for (std::size_t k = 0; k < 9; ++k) {
               if (bits(s[k / 3][k % 3]) != bits(t[k / 3][k % 3])) return false;
             }
             return true;
           });
  }

  std::string message(const std::vector<std::string>& files) {
    try {
      (void)triangles_of(files, 10);
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  }

  TempFolder folder_;
};

TEST_F(MeshTriangles, PointsReportWhetherThereMayBeFaces) {
  const std::string header =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n"
      "property float y\nproperty float z\n";
  const std::string vertices = "end_header\n0 0 0\n1 0 0\n0 1 0\n";
  const std::string faces = "element face 1\nproperty list uchar int vertex_indices\n";
  const std::string cloud = put("cloud.ply", header + vertices);
  const std::string mesh = put("mesh.ply", header + faces + vertices + "3 0 1 2\n");
  const std::string text = put("text.xyz", "0 0 0\n");
  const std::string obj = put("cloud.obj", "v 0 0 0\n");
  const auto may_have_faces = [](const std::vector<std::string>& files) {
    return open_source(files)->info().faces;
  };
  EXPECT_FALSE(may_have_faces({cloud}));
  EXPECT_TRUE(may_have_faces({mesh}));
  EXPECT_TRUE(may_have_faces({cloud, mesh}));
  EXPECT_FALSE(may_have_faces({text}));
  EXPECT_TRUE(may_have_faces({obj}));  // known only at its end
  SourceOptions optional = options();
  optional.needs_faces = false;
  PointBlock block;
  EXPECT_FALSE(open_source(std::vector{obj}, optional)->next(block));
  EXPECT_THROW((void)open_source(std::vector{obj}, options())->next(block), Error);
  const auto both = open_source(std::vector{cloud, mesh}, optional);
  ASSERT_TRUE(both->next(block));
  EXPECT_EQ(block.size(), 1u);
}

TEST_F(MeshTriangles, MatchTheMesh) {
  const std::string obj =
      "v 0 0 0\nv 1 0 -0.0\nv 1 1 0.1\nf 1 2 3\nv 0 1 0\nv -0.5 0.5 1e-300\nf 1 2 3 4 5\nf -1 -2 "
      "-3\n";
  const std::string off =
      "OFF\n5 3 0\n0 0 0\n1 0 -0.0\n1 1 0.1\n0 1 0\n-0.5 0.5 1e-300\n3 0 1 2\n"
      "5 0 1 2 3 4\n3 4 3 2\n";
  std::string stl = "solid s\n";
  for (const char* const loop : {"0 0 0 1 0 0 1 1 0.5", "1 2 3 4 5 6 7 8 9.25"}) {
    stl += "facet normal 0 0 1\nouter loop\n";
    const std::string text = loop;
    std::size_t at = 0;
    for (int v = 0; v < 3; ++v) {
      std::size_t end = at;
      for (int blank = 0; blank < 3 && end != std::string::npos; ++blank) {
        end = text.find(' ', end + 1);
      }
      stl += "vertex " + text.substr(at, end - at) + "\n";
      at = end == std::string::npos ? end : end + 1;
    }
    stl += "endloop\nendfacet\n";
  }
  stl += "endsolid s\n";
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float "
      "z\n"
      "property uchar red\nelement face 2\nproperty list uchar int vertex_indices\n"
      "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
      "0 0 0 1\n1 0 -0 2\n1 1 0.1 3\n0 1 0 4\n-0.5 0.5 7 5\n3 0 1 2\n4 0 1 2 3\n6 0 1 2 3 -1 4\n";
  const std::string packed = put("a.obj", obj);
  for (const auto& [name, content, count] :
       {std::tuple{"b.obj", obj, 5u}, {"c.off", off, 5u}, {"d.stl", stl, 2u}, {"e.ply", ply, 5u}}) {
    SCOPED_TRACE(name);
    const std::string file = put(name, content);
    const std::vector<Corners> expected = in_memory(file);
    ASSERT_EQ(expected.size(), count);
    for (const std::size_t block : {std::size_t{1}, std::size_t{2}, std::size_t{100}}) {
      EXPECT_TRUE(same_bits(triangles_of({file}, block), expected)) << block;
    }
  }
  // One file after the other.
  std::vector<Corners> twice = in_memory(packed);
  twice.insert(twice.end(), twice.begin(), twice.begin() + 5);
  EXPECT_TRUE(same_bits(triangles_of({packed, put("b.obj", obj)}, 3), twice));
}

// More vertices than are kept in memory, referenced in random order.
TEST_F(MeshTriangles, ReferToVerticesAnywhereInALargeFile) {
  std::mt19937_64 random(77);
  constexpr std::uint32_t kVertices = 750'001, kTriangles = 20'000;
  std::vector<Point3> vertices(kVertices);
  for (Point3& v : vertices) {
    for (double& x : v) x = static_cast<double>(random()) * 1e-7;
  }
  std::vector<TriangleIndices> triangles(kTriangles);
  for (TriangleIndices& t : triangles) {
    for (std::uint32_t& v : t) v = static_cast<std::uint32_t>(random() % kVertices);
  }
  triangles.back() = {0, kVertices - 1, 1024};
  const std::string file = (folder_.path() / "large.ply").string();
  const auto writer = open_mesh_writer(file, {.vertices = kVertices, .triangles = kTriangles});
  writer->add_vertices(vertices);
  writer->add_triangles(triangles);
  writer->finish();
  std::vector<Corners> expected;
  for (const TriangleIndices& t : triangles) {
    expected.push_back({vertices[t[0]], vertices[t[1]], vertices[t[2]]});
  }
  EXPECT_TRUE(same_bits(triangles_of({file}, 10000), expected));
}

TEST_F(MeshTriangles, ErrorsNameFilesWithoutTriangles) {
  EXPECT_NE(message({put("a.obj", "v 0 0 0\nv 1 1 1\n")}).find("no faces"), std::string::npos);
  EXPECT_NE(message({put("a.xyz", "0 0 0\n1 1 1\n")}).find("xyz has no triangles"),
            std::string::npos);
  EXPECT_NE(message({put("b.obj", "v 0 0 0\nf 1 2 3\n")}).find("line 2"), std::string::npos);
  EXPECT_NE(
      message({put("c.ply",
                   "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float "
                   "y\nproperty float z\nelement face 1\nproperty list uchar int "
                   "vertex_indices\nend_header\n0 0 0\n3 0 0 1\n")})
          .find("face 0"),
      std::string::npos);
}

}  // namespace
}  // namespace terrace::stream
