// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <random>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "point_files.hpp"
#include "temp_folder.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/gzip.hpp"
#include "terrace/stream/mesh_reader.hpp"
#include "terrace/stream/source.hpp"

/// OBJ, OFF and STL as points and as meshes. This test writes one random mesh in all formats.

namespace terrace::stream {
namespace {

struct SmallMesh {
  std::vector<Point3> vertices;
  std::vector<std::array<std::uint32_t, 3>> faces;
};

SmallMesh random_mesh(std::mt19937_64& random) {
  SmallMesh mesh;
  const std::size_t count = 3 + random() % 60;
  for (std::size_t i = 0; i < count; ++i) {
    // Floats, which all formats can hold exactly; all vertices are distinct.
    const auto coordinate = [&] {
      return static_cast<double>(static_cast<float>(random() % 100000) / 7);
    };
    mesh.vertices.push_back({coordinate(), coordinate(), static_cast<double>(i)});
  }
  for (std::size_t i = 0; i < random() % 100; ++i) {
    const auto first = static_cast<std::uint32_t>(random() % (count - 2));
    mesh.faces.push_back({first, first + 1, first + 2});
  }
  return mesh;
}

std::string number(double value) {
  std::string text(40, '\0');
  text.resize(static_cast<std::size_t>(std::snprintf(text.data(), text.size(), "%.17g", value)));
  return text;
}

std::string place(const Point3& p) {
  return number(p[0]) + " " + number(p[1]) + " " + number(p[2]);
}

std::string obj_of(const SmallMesh& mesh) {
  std::string text = "# made by a test\nmtllib none.mtl\no thing\n";
  for (const Point3& p : mesh.vertices) text += "v " + place(p) + "\nvn 0 0 1\n";
  for (const auto& f : mesh.faces) {
    text += "f";
    for (const std::uint32_t v : f) text += " " + std::to_string(v + 1) + "//1";
    text += "\n";
  }
  return text;
}

std::string off_of(const SmallMesh& mesh, bool colours) {
  std::string text = colours ? "COFF # colours\n\n" : "OFF\n";
  text += std::to_string(mesh.vertices.size()) + " " + std::to_string(mesh.faces.size()) + " 0\n";
  for (const Point3& p : mesh.vertices) text += place(p) + (colours ? " 1 0.5 0 1\r\n" : "\n");
  for (const auto& f : mesh.faces) {
    text += "3";
    for (const std::uint32_t v : f) text += " " + std::to_string(v);
    text += colours ? " 255 0 0\n" : "\n";
  }
  return text;
}

std::string stl_text_of(const SmallMesh& mesh) {
  std::string text = "solid thing\n";
  for (const auto& f : mesh.faces) {
    text += "  facet normal 0 0 1\n    outer loop\n";
    for (const std::uint32_t v : f) text += "      vertex " + place(mesh.vertices[v]) + "\n";
    text += "    endloop\n  endfacet\n";
  }
  return text + "endsolid thing\n";
}

template <class T>
void append(std::string& bytes, T value) {
  auto number = std::bit_cast<std::array<char, sizeof(T)>>(value);
  if constexpr (std::endian::native == std::endian::big) std::reverse(number.begin(), number.end());
  bytes.append(number.data(), number.size());
}

std::string stl_binary_of(const SmallMesh& mesh) {
  std::string bytes = "solid is what some write here";
  bytes.resize(80, ' ');
  append(bytes, static_cast<std::uint32_t>(mesh.faces.size()));
  for (const auto& f : mesh.faces) {
    for (int i = 0; i < 3; ++i) append(bytes, 0.5F);
    for (const std::uint32_t v : f) {
      for (const double x : mesh.vertices[v]) append(bytes, static_cast<float>(x));
    }
    append(bytes, std::uint16_t{7});
  }
  return bytes;
}

std::vector<Point3> corners_of(const SmallMesh& mesh) {
  std::vector<Point3> corners;
  for (const auto& f : mesh.faces) {
    for (const std::uint32_t v : f) corners.push_back(mesh.vertices[v]);
  }
  return corners;
}

class MeshFormats : public ::testing::Test {
 protected:
  std::string put(const std::string& name, const std::string& content) const {
    const std::string path = (folder_.path() / name).string();
    std::ofstream(path, std::ios::binary) << content;
    return path;
  }
  TempFolder folder_;
};

TEST_F(MeshFormats, ReadsVerticesAsPoints) {
  std::mt19937_64 random(31);
  for (int round = 0; round < 40; ++round) {
    SCOPED_TRACE("seed 31, round " + std::to_string(round));
    const SmallMesh mesh = random_mesh(random);
    const std::vector<Point3> corners = corners_of(mesh);
    struct Case {
      std::string name, content, format;
      const std::vector<Point3>* points;
      ScalarType type = ScalarType::f64;
    };
    const std::vector<Case> cases{{"a.obj", obj_of(mesh), "obj", &mesh.vertices},
                                  {"a.off", off_of(mesh, false), "off", &mesh.vertices},
                                  {"c.off", off_of(mesh, true), "off", &mesh.vertices},
                                  {"named_otherwise", obj_of(mesh), "obj", &mesh.vertices},
                                  {"named.xyz", off_of(mesh, true), "off", &mesh.vertices},
                                  {"a.stl", stl_text_of(mesh), "stl", &corners},
                                  {"named.ply", stl_text_of(mesh), "stl", &corners},
                                  {"b.stl", stl_binary_of(mesh), "stl", &corners, ScalarType::f32}};
    for (const Case& c : cases) {
      SCOPED_TRACE(c.name);
      for (const bool packed : {false, true}) {
        std::string content = c.content;
        if (packed) {
          const auto bytes = gzip(std::as_bytes(std::span(c.content)));
          content.assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
        }
        const std::string file = put(c.name + (packed ? ".gz" : ""), content);
        const AllPoints points = read_all({file}, {.block_points = 1 + random() % 50});
        EXPECT_EQ(points.info.format, c.format);
        EXPECT_EQ(points.info.coordinates[0].type, c.type);
        EXPECT_EQ(points.points.positions, *c.points);
        const bool counted = c.format == "off";
        EXPECT_EQ(points.info.points == c.points->size(), counted || points.info.points);
      }
    }
  }
}

TEST_F(MeshFormats, AllFormatsGiveTheSameFaces) {
  std::mt19937_64 random(32);
  for (int round = 0; round < 40; ++round) {
    SCOPED_TRACE("seed 32, round " + std::to_string(round));
    SmallMesh mesh = random_mesh(random);
    if (mesh.faces.empty()) mesh.faces.push_back({2, 1, 0});
    const std::vector<Point3> corners = corners_of(mesh);
    for (const auto& [name, content] :
         std::vector<std::pair<std::string, std::string>>{{"a.obj", obj_of(mesh)},
                                                          {"a.off", off_of(mesh, round % 2 == 0)},
                                                          {"a.stl", stl_text_of(mesh)},
                                                          {"b.stl", stl_binary_of(mesh)}}) {
      SCOPED_TRACE(name);
      const auto file = read_mesh(put(name, content));
      ASSERT_TRUE(file);
      ASSERT_EQ(file->triangles.size(), mesh.faces.size());
      std::vector<Point3> file_corners;
      for (const TriangleIndices& t : file->triangles) {
        for (const std::uint32_t v : t) file_corners.push_back(file->vertices.positions.at(v));
      }
      EXPECT_EQ(file_corners, corners);
      // Coincident corners are merged to one vertex.
      const std::set<Point3> places(corners.begin(), corners.end());
      const bool soup = name.ends_with("stl");
      EXPECT_EQ(file->vertices.size(), soup ? places.size() : mesh.vertices.size());
    }
  }
}

/// A vertex with NaN is not a point, and its triangles are dropped; the others do not change.
TEST_F(MeshFormats, DropsTrianglesWithNaNCorners) {
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
      "property float z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n"
      "nan 0 0\n1 0 0\n1 1 0\n0 1 2\n3 0 1 2\n3 1 2 3\n";
  const std::string stl =
      "solid s\nouter loop\nvertex nan 0 0\nvertex 1 0 0\nvertex 1 1 0\nendloop\n"
      "outer loop\nvertex 1 0 0\nvertex 1 1 0\nvertex 0 1 2\nendloop\nendsolid\n";
  const std::pair<const char*, std::string> files[] = {
      {"a.obj", "v nan 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 2\nf 1 2 3\nf 2 3 4\n"},
      {"a.off", "OFF\n4 2 0\nnan 0 0\n1 0 0\n1 1 0\n0 1 2\n3 0 1 2\n3 1 2 3\n"},
      {"a.ply", ply},
      {"a.stl", stl}};
  for (const auto& [name, text] : files) {
    SCOPED_TRACE(name);
    const std::string file = write_text(folder_.path() / name, text);
    const auto mesh = read_mesh(file);
    ASSERT_TRUE(mesh);
    EXPECT_EQ(mesh->vertices.positions, (std::vector<Point3>{{1, 0, 0}, {1, 1, 0}, {0, 1, 2}}));
    EXPECT_EQ(mesh->triangles, (std::vector<TriangleIndices>{{0, 1, 2}}));
    EXPECT_EQ(mesh->nodata, 1u);
    const auto triangles = open_source(std::array{file}, {.entities = Entities::triangles});
    EXPECT_EQ(read_all(*triangles).points.positions, (std::vector<Point3>{{1, 0, 0}}));
    EXPECT_EQ(triangles->progress().nodata, 1u);
    const auto points = open_source(std::array{file});
    EXPECT_EQ(read_all(*points).points.size(), text == stl ? 5u : 3u);
    EXPECT_EQ(points->progress().nodata, 1u);
  }
}

TEST_F(MeshFormats, ErrorsNameTheDamage) {
  std::mt19937_64 random(33);
  SmallMesh mesh = random_mesh(random);
  mesh.faces.push_back({0, 1, 2});
  const std::string binary = stl_binary_of(mesh);
  std::string large = binary;
  large.replace(80, 4, "\xff\xff\xff\xff", 4);
  const auto message = [](const auto& work) -> std::string {
    try {
      work();
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  for (const auto& [name, content, words] : std::vector<std::array<std::string, 3>>{
           {"a.off", "OFF\n3 0 0\n0 0 0\n1 1 1\n", "ends after 2 of 3 vertices"},
           {"b.off", "OFF\n9999999999999 0 0\n0 0 0\n", "ends after 1 of 9999999999999"},
           {"c.off", "OFF\n", "counts"},
           {"d.off", "OFF BINARY\nxyz", "binary OFF"},
           {"e.off", "OFF\n1 0 0\n1 2\n", "three coordinates"},
           {"f.off", "OFF\n1 0 0\n1 2 inf\n", "three coordinates"},
           {"g.off", "OFF\n-1 0 0\n", "how many vertices"},
           {"h.obj", "v 1 2\n", "line 1"},
           {"i.stl", binary.substr(0, binary.size() - 1), "promises"},
           {"j.stl", large, "promises 4294967295 triangles"},
           {"k.stl", "short", "too short"},
           {"l.stl",
            "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nendloop\n",
            "fewer than three"},
           {"m.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n", "ends within"},
           {"n.stl", "solid a\nvertex 0 0 0\n", "outside a loop"}}) {
    SCOPED_TRACE(name);
    const std::string file = put(name, content);
    const std::string error = message([&] { read_all({file}); });
    EXPECT_NE(error.find(words), std::string::npos) << error;
    EXPECT_NE(error.find(name), std::string::npos) << error;
  }
  for (const auto& [name, content] : std::vector<std::pair<std::string, std::string>>{
           {"p.off", "OFF\n1 1 0\n0 0 0\n3 0 0 1\n"},
           {"q.off", "OFF\n1 1 0\n0 0 0\n99999999999 0\n"},
           {"r.off", "OFF\n1 2 0\n0 0 0\n1 0\n"},
           {"s.obj", "v 0 0 0\nf 1 1 2\n"}}) {
    const std::string file = put(name, content);
    EXPECT_NE(message([&] { (void)read_mesh(file); }), "") << name;
  }
}

/// Four vertices and two triangles, in all notations that OBJ allows.
TEST_F(MeshFormats, ReadsObjLinesThatAreContinuedIndentedOrTabbed) {
  const std::vector<Point3> square{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}};
  const std::string vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\n";
  for (const std::string& text : std::vector<std::string>{
           vertices + "f 1 2 \\\n4 3\n", vertices + "f 1 2\\\r\n 4\\\r\n3",
           "v 0 0 \\\n0\nv 1 0 0\nv 0 1 0\nv \\\n 1 \\\n1 0\nf 1 2 4 3\n",
           "v\t0\t0\t0\nv\t1\t0\t0\nv\t0\t1\t0\nv\t1\t1\t0\nf\t1\t2\t4\t3\n",
           "# by hand\no part\n  v 0 0 0\n\tv 1 0 0\n  v 0 1 0\n  v 1 1 0\n   f 1 2 4 3  \n",
           "\xEF\xBB\xBF" + vertices + "f 1 2 4 3\n",
           "# C:\\models\\\n" + vertices + "f 1 2 4 3 # all\n",
           "g\n" + vertices + "f 1 2 4 3 \\"}) {
    for (const char* const name : {"square.obj", "named_otherwise"}) {
      SCOPED_TRACE(name + (": " + text));
      const auto mesh = read_mesh(put(name, text));
      ASSERT_TRUE(mesh);
      EXPECT_EQ(mesh->info.format, "obj");
      EXPECT_EQ(mesh->vertices.positions, square);
      EXPECT_EQ(mesh->triangles, (std::vector<TriangleIndices>{{0, 1, 3}, {0, 3, 2}}));
    }
  }
  std::string endless = "v 0 0 \\\n";
  for (int i = 0; i < 100000; ++i) endless += "\\\n";
  EXPECT_NE(error_of([&] { read_all({put("endless.obj", endless)}); }).find("its continuations"),
            std::string::npos);
}

/// Text in UTF-16 is not read as text without points.
TEST_F(MeshFormats, RejectsUtf16WithARemedy) {
  const std::string obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  const std::pair<const char*, std::string> files[] = {
      {"a.obj", obj},
      {"a.off", "OFF\n1 0 0\n0 0 0\n"},
      {"a.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n"},
      {"a.xyz", "1 2 3\n4 5 6\n"},
      {"a.csv", "x,y,z\n1,2,3\n"},
      {"a.ply", "ply\nformat ascii 1.0\n"},
      {"a.asc", "ncols 2\nnrows 1\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2\n"},
      {"a.geojson", R"({"type":"Point","coordinates":[1,2]})"}};
  for (const auto& [name, text] : files) {
    for (const bool big : {false, true}) {
      for (const bool mark : {false, true}) {
        SCOPED_TRACE(std::string(name) + (big ? ", big" : ", little") + (mark ? ", mark" : ""));
        std::string wide = !mark ? "" : big ? "\xFE\xFF" : "\xFF\xFE";
        for (const char c : text) {
          if (big) wide += '\0';
          wide += c;
          if (!big) wide += '\0';
        }
        const std::string file = put(name, wide);
        EXPECT_NE(error_of([&] { read_all({file}); }).find("is text in UTF-16"), std::string::npos)
            << error_of([&] { read_all({file}); });
      }
    }
  }
}

// Facts of real files, if they are available.
TEST(MeshFormatsReal, MatchTheirReadme) {
  const char* data = std::getenv("TERRACE_DATA");
  if (data == nullptr) GTEST_SKIP() << "TERRACE_DATA is not set";
  const std::string scan = std::string(data) + "/scan/";
  EXPECT_EQ(read_all({scan + "cow.obj"}).points.size(), 2903U);
  EXPECT_EQ(read_all({scan + "cow.off"}).points.size(), 2762U);
  const auto cow = read_mesh(scan + "cow.off");
  ASSERT_TRUE(cow);
  EXPECT_EQ(cow->triangles.size(), 5520U);
  // Compressed, as in the archive of scans.
  EXPECT_GT(read_all({scan + "dragon_vrip_res3.ply.gz"}).points.size(), 10'000U);
}

}  // namespace
}  // namespace terrace::stream
