// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "point_files.hpp"
#include "terrace/stream/mesh_reader.hpp"
#include "terrace/stream/mesh_writer.hpp"

namespace terrace::stream {
namespace {

struct Mesh {
  std::vector<Point3> positions;
  std::vector<float> levels;
  std::vector<TriangleIndices> triangles;
};

Mesh random_mesh(std::uint64_t seed, std::size_t vertices, std::size_t triangles) {
  std::mt19937_64 random(seed);
  const auto unit = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  Mesh mesh;
  for (std::size_t i = 0; i < vertices; ++i) {
    mesh.positions.push_back({691000.0 + 1000 * unit(), 5338000.0 + 2000 * unit(), 500 * unit()});
    mesh.levels.push_back(static_cast<float>(random() % 9));
  }
  for (std::size_t i = 0; i < triangles; ++i) {
    TriangleIndices triangle;
    for (auto& index : triangle) index = static_cast<std::uint32_t>(random() % vertices);
    mesh.triangles.push_back(triangle);
  }
  return mesh;
}

void write(const std::string& path, const Mesh& mesh, MeshHeader header,
           const WriterOptions& options = {}, std::size_t piece = 1000) {
  header.vertices = mesh.positions.size();
  header.triangles = mesh.triangles.size();
  const auto writer = open_mesh_writer(path, header, options);
  const std::size_t columns = header.attributes.size();
  for (std::size_t i = 0; i < mesh.positions.size(); i += piece) {
    const std::size_t n = std::min(piece, mesh.positions.size() - i);
    writer->add_vertices(
        std::span(mesh.positions).subspan(i, n),
        columns == 0 ? std::span<const float>{} : std::span(mesh.levels).subspan(i, n));
  }
  for (std::size_t i = 0; i < mesh.triangles.size(); i += piece) {
    writer->add_triangles(
        std::span(mesh.triangles).subspan(i, std::min(piece, mesh.triangles.size() - i)));
  }
  EXPECT_FALSE(std::filesystem::exists(path)) << "published too early";
  writer->finish();
}

template <class T>
T at(const std::string& bytes, std::size_t offset) {
  T value;
  EXPECT_LE(offset + sizeof value, bytes.size());
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

class MeshOutput : public ::testing::Test {
 protected:
  std::string path(const std::string& name) { return (folder_.path() / name).string(); }

  TempFolder folder_;
};

TEST_F(MeshOutput, ObjHasExactDoublesAndCountsFromOne) {
  const Mesh mesh = random_mesh(1, 2500, 4000);
  write(path("m.obj"), mesh, {.attributes = {"level"}, .comments = {"one", "two\nthree"}});
  std::istringstream lines(read_text(path("m.obj")));
  std::string line;
  Mesh back;
  std::vector<std::string> comments;
  while (std::getline(lines, line)) {
    if (line[0] == '#') {
      comments.push_back(line);
      continue;
    }
    std::istringstream words(line.substr(1));
    std::string a, b, c, rest;
    words >> a >> b >> c;
    EXPECT_FALSE(words >> rest) << line;
    if (line[0] == 'v') {
      EXPECT_TRUE(back.triangles.empty());
      back.positions.push_back({std::stod(a), std::stod(b), std::stod(c)});
    } else {
      ASSERT_EQ(line[0], 'f');
      const auto index = [](const std::string& word) {
        return static_cast<std::uint32_t>(std::stoul(word) - 1);
      };
      back.triangles.push_back({index(a), index(b), index(c)});
    }
  }
  EXPECT_EQ(comments, (std::vector<std::string>{"# one", "# two three"}));
  EXPECT_TRUE(same_bits(back.positions, mesh.positions));
  EXPECT_EQ(back.triangles, mesh.triangles);
}

TEST_F(MeshOutput, RoundTripsPlyBitForBit) {
  const Mesh mesh = random_mesh(2, 2500, 4000);
  for (const std::string format : {"ply", "ply-ascii"}) {
    SCOPED_TRACE(format);
    const std::string file = path(format + ".ply");
    write(file, mesh, {.attributes = {"level"}, .comments = {"c"}}, {.format = format});
    const AllPoints all = read_file(file);
    EXPECT_TRUE(same_bits(all.points.positions, mesh.positions));
    ASSERT_EQ(all.info.attributes.size(), 1u);
    EXPECT_EQ(all.info.attributes[0].name, "level");
    const auto levels = all.values<float>(0);
    ASSERT_EQ(levels.size(), mesh.levels.size());
    for (std::size_t i = 0; i < levels.size(); ++i) ASSERT_EQ(levels[i], mesh.levels[i]);
    const std::string bytes = read_text(file);
    const std::size_t body = bytes.find("end_header\n") + 11;
    if (format == "ply") {
      ASSERT_EQ(bytes.size(), body + 2500 * 28 + 4000 * 13);
      for (std::size_t i = 0; i < 4000; ++i) {
        const std::size_t face = body + 2500 * 28 + i * 13;
        EXPECT_EQ(bytes[face], 3);
        for (std::size_t k = 0; k < 3; ++k) {
          EXPECT_EQ(at<std::uint32_t>(bytes, face + 1 + 4 * k), mesh.triangles[i][k]);
        }
      }
    } else {
      std::istringstream last(bytes.substr(bytes.rfind('\n', bytes.size() - 2)));
      std::uint32_t n, a, b, c;
      last >> n >> a >> b >> c;
      EXPECT_EQ(n, 3u);
      EXPECT_EQ((TriangleIndices{a, b, c}), mesh.triangles.back());
    }
  }
}

/// A GLB file parsed according to the specification.
struct Glb {
  nlohmann::json json;
  std::string binary;

  explicit Glb(const std::string& bytes) {
    EXPECT_EQ(bytes.substr(0, 4), "glTF");
    EXPECT_EQ(at<std::uint32_t>(bytes, 4), 2u);
    EXPECT_EQ(at<std::uint32_t>(bytes, 8), bytes.size());
    const std::size_t json_bytes = at<std::uint32_t>(bytes, 12);
    EXPECT_EQ(bytes.substr(16, 4), "JSON");
    EXPECT_EQ(json_bytes % 4, 0u);
    json = nlohmann::json::parse(bytes.substr(20, json_bytes));
    const std::size_t chunk = 20 + json_bytes;
    if (chunk == bytes.size()) return;
    const std::size_t binary_bytes = at<std::uint32_t>(bytes, chunk);
    EXPECT_EQ(bytes.substr(chunk + 4, 4), std::string("BIN\0", 4));
    EXPECT_EQ(binary_bytes % 4, 0u);
    EXPECT_EQ(chunk + 8 + binary_bytes, bytes.size());
    binary = bytes.substr(chunk + 8);
    EXPECT_EQ(json["buffers"][0]["byteLength"], binary_bytes);
  }
  /// Element `i`, component `k` of an accessor.
  template <class T>
  [[nodiscard]] T value(std::size_t accessor, std::size_t i, std::size_t k) const {
    const auto& a = json["accessors"][accessor];
    const auto& view = json["bufferViews"][a["bufferView"].get<std::size_t>()];
    const std::size_t components = a["type"] == "VEC3" ? 3 : 1;
    const std::size_t stride = view.value("byteStride", sizeof(T) * components);
    const std::size_t inside = a.value("byteOffset", std::size_t{0}) + i * stride + k * sizeof(T);
    EXPECT_LE(inside + sizeof(T), view["byteLength"].get<std::size_t>());
    return at<T>(binary, view.value("byteOffset", std::size_t{0}) + inside);
  }
};

TEST_F(MeshOutput, GlbStoresPositionsRelativeToItsOrigin) {
  const Mesh mesh = random_mesh(3, 3000, 5001);
  Box3 bounds;
  for (const Point3& p : mesh.positions) bounds.include(p);
  for (const bool with_bounds : {true, false}) {
    SCOPED_TRACE(with_bounds);
    MeshHeader header{.attributes = {"level"}};
    if (with_bounds) header.bounds = bounds;
    const std::string file = path(with_bounds ? "a.glb" : "b.glb");
    write(file, mesh, header, {}, 700);
    const MeshRounding rounding(file, bounds);
    const Glb glb(read_text(file));
    EXPECT_EQ(glb.json["asset"]["version"], "2.0");
    const auto& node = glb.json["nodes"][0];
    const auto& primitive = glb.json["meshes"][0]["primitives"][0];
    EXPECT_EQ(primitive["mode"], 4);
    const std::size_t position = primitive["attributes"]["POSITION"];
    const std::size_t level = primitive["attributes"]["_LEVEL"];
    const std::size_t indices = primitive["indices"];
    const auto& accessor = glb.json["accessors"][position];
    ASSERT_EQ(accessor["count"], 3000);
    ASSERT_EQ(glb.json["accessors"][indices]["count"], 3 * 5001);
    EXPECT_EQ(accessor["componentType"], 5126);
    EXPECT_EQ(glb.json["accessors"][indices]["componentType"], 5125);
    std::array<float, 3> min{INFINITY, INFINITY, INFINITY}, max{-INFINITY, -INFINITY, -INFINITY};
    for (std::size_t i = 0; i < 3000; ++i) {
      std::array<double, 3> world;
      for (std::size_t k = 0; k < 3; ++k) {
        const float stored = glb.value<float>(position, i, k);
        min[k] = std::min(min[k], stored);
        max[k] = std::max(max[k], stored);
        world[k] = node["translation"][k].get<double>() + static_cast<double>(stored);
      }
      // glTF's y is up: (x, y, z) here is (x, z, -y) there.
      const Point3 back{world[0], -world[2], world[1]};
      for (std::size_t k = 0; k < 3; ++k) {
        const double reach = with_bounds ? 1000 : 2000;
        EXPECT_NEAR(back[k], mesh.positions[i][k], reach * 0x1p-24 + 1e-9);
        if (with_bounds) {
          EXPECT_LE(std::abs(back[k] - mesh.positions[i][k]), rounding.largest()[k]);
          EXPECT_EQ(back[k], rounding(mesh.positions[i])[k]);
        }
      }
      EXPECT_EQ(glb.value<float>(level, i, 0), mesh.levels[i]);
    }
    for (std::size_t k = 0; k < 3; ++k) {
      // The decimal numbers are exactly the stored floats.
      EXPECT_EQ(accessor["min"][k].get<double>(), static_cast<double>(min[k]));
      EXPECT_EQ(accessor["max"][k].get<double>(), static_cast<double>(max[k]));
    }
    for (std::size_t i = 0; i < 5001; ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        EXPECT_EQ(glb.value<std::uint32_t>(indices, 3 * i + k, 0), mesh.triangles[i][k]);
      }
    }
  }
}

/// A triangle with a value before and after its normals, the second of which is unknown.
const std::vector<std::string> kAroundNormals{"level", "nx", "ny", "nz", "weight"};
const std::vector<float> kNormalValues{1, 0.6F, 0, 0.8F, 7, 2, 0, 0, 0, 8, 3, 0, -1, 0, 9};

void write_with_normals(const std::string& path, const WriterOptions& options = {}) {
  const auto writer = open_mesh_writer(
      path, {.vertices = 3, .triangles = 1, .attributes = kAroundNormals}, options);
  writer->add_vertices(std::vector<Point3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, kNormalValues);
  writer->add_triangles(std::vector<TriangleIndices>{{0, 1, 2}});
  writer->finish();
}

TEST_F(MeshOutput, GlbHasUnitNormalsWithYUp) {
  write_with_normals(path("n.glb"));
  const Glb glb(read_text(path("n.glb")));
  const auto& primitive = glb.json["meshes"][0]["primitives"][0];
  const auto& attributes = primitive["attributes"];
  EXPECT_EQ(attributes.size(), 4u);
  const std::size_t normal = attributes["NORMAL"];
  EXPECT_EQ(glb.json["accessors"][normal]["type"], "VEC3");
  const float expected[3][3] = {{0.6F, 0.8F, 0}, {0, 1, 0}, {0, 0, 1}};
  for (std::size_t v = 0; v < 3; ++v) {
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_EQ(glb.value<float>(normal, v, k), expected[v][k]) << v << " " << k;
    }
    EXPECT_EQ(glb.value<float>(attributes["_LEVEL"], v, 0), static_cast<float>(1 + v));
    EXPECT_EQ(glb.value<float>(attributes["_WEIGHT"], v, 0), static_cast<float>(7 + v));
    EXPECT_EQ(glb.value<std::uint32_t>(primitive["indices"], v, 0), v);
  }
  const auto back = read_mesh(path("n.glb"));
  ASSERT_TRUE(back);
  EXPECT_EQ(back->triangles, (std::vector<TriangleIndices>{{0, 1, 2}}));
}

TEST_F(MeshOutput, ObjAndPlyHaveNormals) {
  write_with_normals(path("n.obj"));
  EXPECT_EQ(read_text(path("n.obj")),
            "v 0 0 0\nvn 0.6 0 0.8\nv 1 0 0\nvn 0 0 0\nv 0 1 0\nvn 0 -1 0\nf 1//1 2//2 3//3\n");
  const auto back = read_mesh(path("n.obj"));
  ASSERT_TRUE(back);
  EXPECT_EQ(back->triangles, (std::vector<TriangleIndices>{{0, 1, 2}}));
  write_with_normals(path("n.ply"), {.format = "ply-ascii"});
  const std::string ply = read_text(path("n.ply"));
  EXPECT_NE(ply.find("property float nx\nproperty float ny\nproperty float nz\n"),
            std::string::npos);
  EXPECT_NE(ply.find("\n0 0 0 1 0.6 0 0.8 7\n"), std::string::npos) << ply;
}

TEST_F(MeshOutput, GlbIsInMetres) {
  Mesh mesh = random_mesh(6, 1000, 300);
  const Point3 far{500, -300, 1000};
  for (Point3& p : mesh.positions) {
    for (std::size_t k = 0; k < 3; ++k) p[k] = far[k] + p[k] / 1000;
  }
  Box3 bounds;
  for (const Point3& p : mesh.positions) bounds.include(p);
  for (const bool local : {true, false}) {
    SCOPED_TRACE(local);
    // Names are not always UTF-8.
    const MeshFrame frame{
        .metres = {77000.25, 111000.5, 0.3048}, .local = local, .crs = "EPSG \xff"};
    const std::string file = path(local ? "local.glb" : "far.glb");
    write(file, mesh, {.bounds = bounds, .frame = frame});
    const MeshRounding rounding(file, bounds, {}, frame);
    const Glb glb(read_text(file));
    const auto& extras = glb.json["asset"]["extras"];
    EXPECT_EQ(extras["metres_per_unit"].get<Point3>(), frame.metres);
    EXPECT_TRUE(extras["crs"].get<std::string>().starts_with("EPSG "));
    const auto translation = glb.json["nodes"][0]["translation"].get<Point3>();
    const auto origin = extras["origin"].get<Point3>();
    EXPECT_EQ(translation[0] == 0 && translation[2] == 0, local);
    EXPECT_EQ(origin[0] != 0 && origin[1] != 0, local);
    EXPECT_EQ(origin[2], 0);
    const std::size_t position = glb.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"];
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
      Point3 scene{};
      for (std::size_t k = 0; k < 3; ++k) {
        scene[k] = translation[k] + static_cast<double>(glb.value<float>(position, i, k));
      }
      const Point3 turned{scene[0], -scene[2], scene[1]};
      for (std::size_t k = 0; k < 3; ++k) {
        const double back = origin[k] + turned[k] / frame.metres[k];
        EXPECT_NEAR(back, rounding(mesh.positions[i])[k], 1e-12 * std::abs(far[k]));
        EXPECT_LE(std::abs(rounding(mesh.positions[i])[k] - mesh.positions[i][k]),
                  rounding.largest()[k]);
      }
    }
  }
  EXPECT_EQ(mesh_format(path("m.glb")), "glb");
  EXPECT_EQ(mesh_format(path("m.glb"), {.format = "obj"}), "obj");
}

TEST_F(MeshOutput, OtherFormatsDoNotRound) {
  const Box3 bounds{{691000, 5338000, 0}, {692000, 5340000, 500}};
  const Point3 p{691000.1, 5338000.2, 0.3};
  for (const char* name : {"a.ply", "a.obj"}) {
    const MeshRounding rounding(path(name), bounds);
    EXPECT_EQ(rounding(p), p);
    EXPECT_EQ(rounding.largest(), Point3{});
  }
  EXPECT_NE(MeshRounding(path("a.ply"), bounds, {.format = "glb"})(p), p);
  EXPECT_THROW(MeshRounding(path("a.stl"), bounds), Error);
}

TEST_F(MeshOutput, GlbWithoutTrianglesIsACloudAndWithoutVerticesAnEmptyScene) {
  Mesh mesh = random_mesh(4, 10, 0);
  write(path("cloud.glb"), mesh, {});
  const Glb cloud(read_text(path("cloud.glb")));
  const auto& primitive = cloud.json["meshes"][0]["primitives"][0];
  EXPECT_EQ(primitive["mode"], 0);
  EXPECT_FALSE(primitive.contains("indices"));
  write(path("empty.glb"), {}, {});
  const Glb empty(read_text(path("empty.glb")));
  EXPECT_EQ(empty.json["scenes"].size(), 1u);
  EXPECT_FALSE(empty.json.contains("meshes"));
  EXPECT_FALSE(empty.json.contains("buffers"));
  EXPECT_TRUE(empty.binary.empty());
}

TEST_F(MeshOutput, GlbRejectsMeshesTooLargeForItBeforeWriting) {
  for (const MeshHeader& header : {MeshHeader{.vertices = 400'000'000, .triangles = 0},
                                   MeshHeader{.vertices = 3, .triangles = 1ull << 62},
                                   MeshHeader{.vertices = 200'000'000, .triangles = 200'000'000}}) {
    const std::string error = error_of([&] { open_mesh_writer(path("big.glb"), header); });
    EXPECT_NE(error.find("at most 4 GiB; write PLY"), std::string::npos) << error;
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
}

TEST_F(MeshOutput, BytesDoNotDependOnThePieces) {
  const Mesh mesh = random_mesh(5, 900, 1700);
  for (const std::string ending : {".ply", ".obj", ".glb"}) {
    SCOPED_TRACE(ending);
    write(path("whole" + ending), mesh, {.attributes = {"level"}}, {}, 10000);
    write(path("pieces" + ending), mesh, {.attributes = {"level"}}, {}, 1);
    EXPECT_EQ(read_text(path("whole" + ending)), read_text(path("pieces" + ending)));
    if (ending != ".glb") {
      write(path("empty" + ending), {}, {});
      EXPECT_TRUE(std::filesystem::exists(path("empty" + ending)));
    }
  }
}

TEST_F(MeshOutput, ChoosesFormatsByNameThenByEnding) {
  const auto refusal = [&](const std::string& file, const WriterOptions& options = {}) {
    return error_of([&] { open_mesh_writer(file, {}, options); });
  };
  const std::string unknown = refusal(path("m.stl"));
  for (const std::string_view known : {"obj (.obj)", "ply (.ply)", "ply-ascii", "glb (.glb)"}) {
    EXPECT_NE(unknown.find(known), std::string::npos) << unknown;
  }
  EXPECT_NE(refusal(path("mesh")), "");
  EXPECT_THROW(refusal(path("m.obj"), {.format = "xyz"}), std::invalid_argument);
  EXPECT_NE(refusal("-", {.format = "glb"}).find("cannot be written to a pipe"), std::string::npos);
  EXPECT_EQ(refusal(path("m.PLY")), "");
  EXPECT_EQ(refusal(path("m.dat"), {.format = "obj"}), "");
}

}  // namespace
}  // namespace terrace::stream
