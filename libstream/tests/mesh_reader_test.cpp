// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/mesh_reader.hpp"

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>

#include <gtest/gtest.h>

#include "temp_folder.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/mesh_writer.hpp"

namespace terrace::stream {
namespace {

class MeshReader : public ::testing::Test {
 protected:
  std::optional<MeshFile> read(const std::string& name, const std::string& content) {
    path_ = scratch_.path() / name;
    std::ofstream(path_, std::ios::binary) << content;
    return read_mesh(path_);
  }
  TempFolder scratch_;
  std::string path_;
};

constexpr const char* kSquare =
    "ply\nformat ascii 1.0\ncomment EPSG:4326\nelement vertex 4\nproperty double x\nproperty "
    "double y\n"
    "property float z\nproperty uchar level\nelement face 1\n"
    "property list uchar int vertex_indices\nend_header\n"
    "0 0 1 0\n1 0 2 1\n1 1 3 2\n0 1 4 3\n4 0 1 2 3\n";

TEST_F(MeshReader, SplitsPolygonsIntoFans) {
  const auto file = read("a.ply", kSquare);
  ASSERT_TRUE(file);
  EXPECT_EQ(file->vertices.positions[2], (Point3{1, 1, 3}));
  ASSERT_EQ(file->info.attributes.size(), 1u);
  const auto levels = file->info.view<std::uint8_t>(file->vertices.payload, 0);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(levels[i], i);
  ASSERT_EQ(file->triangles.size(), 2u);
  EXPECT_EQ(file->triangles[1], (std::array<std::uint32_t, 3>{0, 2, 3}));
  EXPECT_EQ(file->info.comments, std::vector<std::string>{"EPSG:4326"});
}

TEST_F(MeshReader, ReadsStrips) {
  const auto file =
      read("s.ply",
           "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float "
           "y\nproperty float z\nelement tristrips 1\nproperty list int int "
           "vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 2 0\n"
           "8 0 1 2 3 -1 2 3 4\n");
  ASSERT_TRUE(file);
  ASSERT_EQ(file->triangles.size(), 3u);
  EXPECT_EQ(file->triangles[1], (std::array<std::uint32_t, 3>{2, 1, 3}));  // reversed
  EXPECT_EQ(file->triangles[2], (std::array<std::uint32_t, 3>{2, 3, 4}));
}

TEST_F(MeshReader, ReadsObjWithAllKindsOfIndices) {
  const auto file = read("a.obj", "# a\nv 0 0 0\nv 1 0 0 1\nv 0 1 0\nvn 0 0 1\nf 1/2/3 2//1 -1\n");
  ASSERT_TRUE(file);
  ASSERT_EQ(file->triangles.size(), 1u);
  EXPECT_EQ(file->triangles[0], (std::array<std::uint32_t, 3>{0, 1, 2}));
}

TEST_F(MeshReader, ReturnsNothingForClouds) {
  EXPECT_FALSE(read("c.ply",
                    "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                    "property float z\nend_header\n1 2 3\n"));
  EXPECT_FALSE(read("c.obj", "v 1 2 3\n"));
  EXPECT_FALSE(read("c.xyz", "1 2 3\n"));
}

// The library's own output is read back bit for bit.
TEST_F(MeshReader, ReadsWhatTheLibraryWrites) {
  const std::vector<Point3> positions{{0.1, 1e7 + 0.2, -3}, {1, 0, 0.5}, {5, 5, 5}};
  const std::vector<float> levels{1, 2, 7};
  const std::vector<TriangleIndices> triangles{{0, 1, 2}};
  for (const char* format : {"ply", "ply-ascii", "obj"}) {
    path_ = scratch_.path() / (format[0] == 'o' ? "round.obj" : "round.ply");
    const auto writer = open_mesh_writer(
        path_,
        {.vertices = 3, .triangles = 1, .attributes = {"level"}, .comments = {}, .bounds = {}},
        {.format = format, .replace = true});
    writer->add_vertices(positions, levels);
    writer->add_triangles(triangles);
    writer->finish();
    const auto file = read_mesh(path_);
    ASSERT_TRUE(file) << format;
    EXPECT_EQ(file->vertices.positions, positions) << format;
    EXPECT_EQ(file->triangles, triangles) << format;
    if (format[0] == 'p') {
      const auto read_back = file->info.view<float>(file->vertices.payload, 0);
      for (std::size_t i = 0; i < levels.size(); ++i) EXPECT_EQ(read_back[i], levels[i]);
    }
  }
}

/// GLB stores floats relative to the middle of the mesh.
TEST_F(MeshReader, ReadsTheGlbThatTheLibraryWrites) {
  const Box3 bounds{{5e5, 5e6, 100}, {5e5 + 64, 5e6 + 64, 300}};
  const std::vector<Point3> positions{
      bounds.min, {5e5 + 0.1, 5e6 + 60.3, 123.456}, {5e5 + 64, 5e6, 7}, bounds.max};
  const std::vector<TriangleIndices> triangles{{0, 2, 1}, {1, 2, 3}};
  path_ = scratch_.path() / "round.glb";
  const auto writer = open_mesh_writer(
      path_,
      {.vertices = 4, .triangles = 2, .attributes = {"level"}, .comments = {}, .bounds = bounds},
      {.format = "glb"});
  writer->add_vertices(positions, std::vector<float>{1, 2, 3, 4});
  writer->add_triangles(triangles);
  writer->finish();
  const auto file = read_mesh(path_);
  ASSERT_TRUE(file);
  EXPECT_EQ(file->triangles, triangles);
  ASSERT_EQ(file->vertices.size(), positions.size());
  const MeshRounding rounding(path_, bounds);
  for (std::size_t v = 0; v < positions.size(); ++v) {
    EXPECT_EQ(file->vertices.positions[v], rounding(positions[v]));
  }
}

// A damaged file is read as it is or refused, and never read beyond its end.
TEST_F(MeshReader, SurvivesDamage) {
  const std::string good = kSquare;
  for (std::size_t end = 0; end < good.size(); ++end) {
    try {
      read("cut.ply", good.substr(0, end));
    } catch (const Error&) {
    }
  }
  std::mt19937_64 random(5);
  for (int trial = 0; trial < 500; ++trial) {
    SCOPED_TRACE(trial);
    std::string bad = good;
    for (int i = 0; i < 3; ++i) bad[random() % bad.size()] = static_cast<char>(random() % 128);
    try {
      const auto file = read("bad.ply", bad);
      if (!file) continue;
      for (const auto& t : file->triangles) {
        for (const std::uint32_t v : t) ASSERT_LT(v, file->vertices.positions.size());
      }
    } catch (const Error&) {
    }
  }
}

// Faces before the vertices cannot be read, and must not be dropped silently.
TEST_F(MeshReader, RejectsFacesBeforeTheVertices) {
  EXPECT_THROW(read("f.ply",
                    "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_index\n"
                    "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
                    "end_header\n3 0 1 2\n0 0 0\n1 0 0\n0 1 0\n"),
               Error);
}

// Their properties could differ, and only some vertices would have levels.
TEST_F(MeshReader, RejectsASecondVertexElement) {
  std::string twice = kSquare;
  const std::string faces = "element face", row = "4 0 1 2 3";
  twice.insert(twice.find(faces), "element vertex 1\nproperty float x\n");
  twice.insert(twice.find(row), "7\n");
  EXPECT_THROW(read("twice.ply", twice), Error);
}

// Facts of the real scans, if they are available.
TEST(MeshReaderReal, MatchesItsReadme) {
  const char* data = std::getenv("TERRACE_DATA");
  if (data == nullptr) GTEST_SKIP() << "TERRACE_DATA is not set";
  struct Fact {
    const char* name;
    std::size_t vertices, triangles;
  };
  for (const Fact& fact : {Fact{"bun_zipper.ply", 35947, 69451}, Fact{"cow.obj", 2903, 5804},
                           Fact{"horse.ply", 48485, 96966}, Fact{"lucy_100k.ply", 49987, 99970}}) {
    const auto file = read_mesh(std::string(data) + "/scan/" + fact.name);
    ASSERT_TRUE(file) << fact.name;
    EXPECT_EQ(file->vertices.positions.size(), fact.vertices) << fact.name;
    EXPECT_EQ(file->triangles.size(), fact.triangles) << fact.name;
  }
}

}  // namespace
}  // namespace terrace::stream
