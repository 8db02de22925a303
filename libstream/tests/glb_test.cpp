// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "point_files.hpp"
#include "temp_folder.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/mesh_reader.hpp"

/// Binary glTF as input. The tests assemble files themselves, from JSON and a buffer, and compute
/// the transforms of nodes from their definition, with quaternions instead of matrices.

namespace terrace::stream {
namespace {

using GlbJson = nlohmann::json;

/// Assembles a file.
struct GlbMaker {
  GlbJson json{{"asset", {{"version", "2.0"}}}};
  std::string binary;

  template <class T>
  std::uint64_t append(const std::vector<T>& values) {
    while (binary.size() % 4 != 0) binary.push_back('\0');
    const std::uint64_t begin = binary.size();
    for (const T value : values) {
      std::array<char, sizeof(T)> bytes{};
      std::memcpy(bytes.data(), &value, sizeof(T));
      binary.append(bytes.data(), bytes.size());
    }
    return begin;
  }
  std::uint64_t add_view(std::uint64_t begin, std::uint64_t bytes, std::uint64_t stride = 0) {
    GlbJson view{{"buffer", 0}, {"byteOffset", begin}, {"byteLength", bytes}};
    if (stride > 0) view["byteStride"] = stride;
    json["bufferViews"].push_back(view);
    return json["bufferViews"].size() - 1;
  }
  std::uint64_t add_accessor(std::uint64_t view, std::uint64_t count, int component,
                             const char* type, std::uint64_t offset = 0) {
    json["accessors"].push_back({{"bufferView", view},
                                 {"byteOffset", offset},
                                 {"componentType", component},
                                 {"count", count},
                                 {"type", type}});
    return json["accessors"].size() - 1;
  }
  /// stride: of positions, each followed by other numbers.
  std::uint64_t add_positions(const std::vector<std::array<float, 3>>& positions,
                              std::uint64_t stride = 12) {
    std::vector<float> numbers;
    for (const auto& p : positions) {
      numbers.insert(numbers.end(), p.begin(), p.end());
      for (std::uint64_t i = 12; i < stride; i += 4) numbers.push_back(-1e30F);
    }
    const std::uint64_t begin = append(numbers);
    return add_accessor(add_view(begin, 4 * numbers.size(), stride > 12 ? stride : 0),
                        positions.size(), 5126, "VEC3");
  }
  std::uint64_t add_indices(const std::vector<std::uint32_t>& indices, unsigned bytes) {
    const auto narrow = [&](auto type) {
      return append(std::vector<decltype(type)>(indices.begin(), indices.end()));
    };
    const std::uint64_t begin = bytes == 1   ? narrow(std::uint8_t{})
                                : bytes == 2 ? narrow(std::uint16_t{})
                                             : narrow(std::uint32_t{});
    return add_accessor(add_view(begin, bytes * indices.size()), indices.size(),
                        bytes == 1   ? 5121
                        : bytes == 2 ? 5123
                                     : 5125,
                        "SCALAR");
  }
  /// A mesh with one primitive in its own node, which is a root unless it becomes a child.
  void add_mesh(const GlbJson& primitive, GlbJson node = GlbJson::object()) {
    json["meshes"].push_back({{"primitives", GlbJson::array({primitive})}});
    node["mesh"] = json["meshes"].size() - 1;
    json["nodes"].push_back(node);
  }

  [[nodiscard]] std::string bytes() const {
    GlbJson all = json;
    if (!all.contains("buffers"))
      all["buffers"] = GlbJson::array({{{"byteLength", binary.size()}}});
    return bytes_of(all.dump());
  }
  [[nodiscard]] std::string bytes_of(std::string text) const {
    while (text.size() % 4 != 0) text.push_back(' ');
    std::string out = "glTF";
    const auto word = [&out](std::uint64_t value) {
      for (unsigned i = 0; i < 4; ++i) out.push_back(static_cast<char>(value >> (8 * i)));
    };
    word(2);
    word(20 + text.size() + 8 + binary.size());
    word(text.size());
    out += "JSON" + text;
    word(binary.size());
    out += std::string("BIN\0", 4) + binary;
    return out;
  }
};

class GlbFiles : public ::testing::Test {
 protected:
  std::string put(const std::string& bytes) {
    const std::string path = (folder_.path() / "mesh.glb").string();
    std::ofstream(path, std::ios::binary) << bytes;
    return path;
  }
  /// Reads a mesh that must exist.
  MeshFile read(const GlbMaker& glb) {
    auto mesh = read_mesh(put(glb.bytes()));
    EXPECT_TRUE(mesh);
    return mesh ? *std::move(mesh) : MeshFile();
  }
  TempFolder folder_;
};

/// q v q*, with unit quaternions (x, y, z, w).
std::array<double, 3> turned(const std::array<double, 4>& q, const std::array<double, 3>& v) {
  const auto product = [](const std::array<double, 4>& a, const std::array<double, 4>& b) {
    return std::array<double, 4>{a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1],
                                 a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
                                 a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3],
                                 a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2]};
  };
  const auto out = product(product(q, {v[0], v[1], v[2], 0}), {-q[0], -q[1], -q[2], q[3]});
  return {out[0], out[1], out[2]};
}

struct Placement3 {
  std::array<double, 3> move{}, scale{1, 1, 1};
  std::array<double, 4> turn{0, 0, 0, 1};

  [[nodiscard]] std::array<double, 3> operator()(std::array<double, 3> p) const {
    for (std::size_t k = 0; k < 3; ++k) p[k] *= scale[k];
    p = turned(turn, p);
    for (std::size_t k = 0; k < 3; ++k) p[k] += move[k];
    return p;
  }
  /// Column by column.
  [[nodiscard]] std::array<double, 16> matrix() const {
    std::array<double, 16> out{};
    for (std::size_t column = 0; column < 3; ++column) {
      std::array<double, 3> axis{};
      axis[column] = scale[column];
      axis = turned(turn, axis);
      std::copy(axis.begin(), axis.end(), out.begin() + static_cast<std::ptrdiff_t>(4 * column));
    }
    std::copy(move.begin(), move.end(), out.begin() + 12);
    out[15] = 1;
    return out;
  }
};

TEST_F(GlbFiles, AppliesTheTransformsOfNodes) {
  std::mt19937_64 random(41);
  const auto number = [&](double limit) {
    return limit * (static_cast<double>(random() % 2001) / 1000 - 1);
  };
  for (int round = 0; round < 60; ++round) {
    SCOPED_TRACE("seed 41, round " + std::to_string(round));
    GlbMaker glb;
    const std::size_t count = 1 + random() % 12;
    std::vector<Placement3> placements(count);
    std::vector<std::size_t> parent(count, count);
    std::vector<std::vector<std::array<float, 3>>> meshes(count);
    for (std::size_t i = 0; i < count; ++i) {
      Placement3& p = placements[i];
      for (std::size_t k = 0; k < 3; ++k) {
        p.move[k] = number(1e6);
        p.scale[k] = number(2) + (random() % 2 == 0 ? 2.5 : -2.5);
      }
      double length = 0;
      for (double& q : p.turn) {
        q = number(1) + 0.01;
        length += q * q;
      }
      for (double& q : p.turn) q /= std::sqrt(length);
      GlbJson node;
      if (random() % 3 == 0) {
        node["matrix"] = p.matrix();
      } else {
        node = {{"translation", p.move}, {"rotation", p.turn}, {"scale", p.scale}};
      }
      for (std::size_t v = 0; v < 3 + random() % 5; ++v) {
        meshes[i].push_back({static_cast<float>(number(10)), static_cast<float>(number(10)),
                             static_cast<float>(number(10))});
      }
      const std::vector<std::uint32_t> corners{0, 1, 2};
      const GlbJson primitive{
          {"attributes", {{"POSITION", glb.add_positions(meshes[i], 12 + 4 * (random() % 3))}}},
          {"indices", glb.add_indices(corners, 1U << random() % 3)}};
      glb.add_mesh(primitive, node);
      if (i > 0 && random() % 2 == 0) {
        parent[i] = random() % i;
        glb.json["nodes"][parent[i]]["children"].push_back(i);
      }
    }
    if (round % 2 == 0) {
      GlbJson roots = GlbJson::array();
      for (std::size_t i = 0; i < count; ++i)
        if (parent[i] == count) roots.push_back(i);
      glb.json["scenes"] = GlbJson::array({GlbJson::object(), {{"nodes", roots}}});
      glb.json["scene"] = 1;
    }
    // Each node before its children, children in their order.
    std::vector<std::size_t> order;
    const auto visit = [&](const auto& self, std::size_t i) -> void {
      order.push_back(i);
      for (std::size_t c = i + 1; c < count; ++c)
        if (parent[c] == i) self(self, c);
    };
    for (std::size_t i = 0; i < count; ++i)
      if (parent[i] == count) visit(visit, i);

    const MeshFile mesh = read(glb);
    std::vector<Point3> expected;
    std::vector<TriangleIndices> triangles;
    for (const std::size_t i : order) {
      bool mirrored = false;
      for (std::size_t above = i; above != count; above = parent[above]) {
        for (const double s : placements[above].scale) mirrored = mirrored != (s < 0);
      }
      const auto first = static_cast<std::uint32_t>(expected.size());
      triangles.push_back({first, first + 1, first + 2});
      if (mirrored) std::swap(triangles.back()[1], triangles.back()[2]);
      for (const auto& v : meshes[i]) {
        std::array<double, 3> p{v[0], v[1], v[2]};
        for (std::size_t above = i; above != count; above = parent[above]) p = placements[above](p);
        expected.push_back({p[0], -p[2], p[1]});
      }
    }
    EXPECT_EQ(mesh.triangles, triangles);
    ASSERT_EQ(mesh.vertices.size(), expected.size());
    for (std::size_t v = 0; v < expected.size(); ++v) {
      double largest = 1;
      for (const double c : expected[v]) largest = std::max(largest, std::abs(c));
      for (std::size_t k = 0; k < 3; ++k) {
        // Up to twelve nested nodes, each of which may enlarge earlier rounding errors.
        EXPECT_NEAR(mesh.vertices.positions[v][k], expected[v][k], 1e-5 * largest);
      }
    }
  }
}

TEST_F(GlbFiles, ReadsTrianglesFromListsStripsAndFans) {
  GlbMaker glb;
  const std::uint64_t positions =
      glb.add_positions({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {0, 2, 0}, {1, 2, 0}});
  const auto primitive = [&](int mode, const std::vector<std::uint32_t>& corners) {
    return GlbJson{{"attributes", {{"POSITION", positions}}},
                   {"indices", glb.add_indices(corners, 2)},
                   {"mode", mode}};
  };
  // They share their vertices, which are read once.
  glb.json["meshes"].push_back(
      {{"primitives",
        {primitive(4, {0, 1, 2, 2, 1, 3}), primitive(5, {0, 1, 2, 3, 3, 5, 4}),
         primitive(6, {5, 4, 3, 2}), primitive(1, {0, 5}), primitive(0, {3}),
         GlbJson{{"attributes", {{"POSITION", positions}}}}}}});
  glb.json["nodes"].push_back({{"mesh", 0}});
  const MeshFile mesh = read(glb);
  EXPECT_EQ(mesh.info.format, "glb");
  EXPECT_EQ(
      mesh.vertices.positions,
      (std::vector<Point3>{{0, 0, 0}, {1, 0, 0}, {0, 0, 1}, {1, 0, 1}, {0, 0, 2}, {1, 0, 2}}));
  EXPECT_EQ(mesh.triangles, (std::vector<TriangleIndices>{{0, 1, 2},
                                                          {2, 1, 3},
                                                          {0, 1, 2},
                                                          {1, 3, 2},
                                                          {3, 5, 4},
                                                          {5, 4, 3},
                                                          {5, 3, 2},
                                                          {0, 1, 2},
                                                          {3, 4, 5}}));
  for (const Point3& p : mesh.vertices.positions) EXPECT_FALSE(std::signbit(p[1]));
  // Without transforms, floats stay floats.
  EXPECT_EQ(mesh.info.coordinates[0].type, ScalarType::f32);
}

/// Time and memory grow linearly with the bytes of the JSON.
TEST_F(GlbFiles, ReadsLargeJsonInLinearTime) {
  GlbMaker glb;
  const std::uint64_t positions = glb.add_positions({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
  const GlbJson triangle{{"attributes", {{"POSITION", positions}}}};
  glb.add_mesh(triangle);
  glb.json["extras"] = GlbJson(400'000, GlbJson::object());
  EXPECT_EQ(read(glb).triangles.size(), 1u);
  glb.json["extras"] = GlbJson(600'000, GlbJson::object());
  EXPECT_NE(error_of([&] { read(glb); }).find("too many values"), std::string::npos);
  glb.json.erase("extras");
  // Many primitives in many places.
  glb.json["meshes"][0]["primitives"] = GlbJson(1100, triangle);
  glb.json["nodes"] = GlbJson(1000, GlbJson{{"mesh", 0}});
  EXPECT_NE(error_of([&] { read(glb); }).find("more than 1048576 placed"), std::string::npos);
}

/// Vertices that are far apart in the file, and more of them than are read at once.
TEST_F(GlbFiles, ReadsLargeMeshesAsPointsAndAsTriangles) {
  GlbMaker glb;
  constexpr std::uint32_t kVertices = 70'000;
  std::vector<std::array<float, 3>> positions;
  std::vector<std::uint32_t> corners;
  std::vector<Point3> expected;
  for (std::uint32_t i = 0; i < kVertices; ++i) {
    positions.push_back({static_cast<float>(i), static_cast<float>(i % 7), 1});
    expected.push_back({static_cast<double>(i) + 4e6, -1, static_cast<double>(i % 7)});
    if (i >= 2) corners.insert(corners.end(), {i - 2, i, kVertices - i});
  }
  corners.resize(corners.size() / 3 * 3);
  // Its indices precede the vertices.
  const std::uint64_t indices = glb.add_indices(corners, 4);
  glb.add_mesh(
      {{"attributes", {{"POSITION", glb.add_positions(positions, 24)}}}, {"indices", indices}},
      {{"translation", {4e6, 0, 0}}});
  const std::string file = put(glb.bytes());
  const AllPoints points = read_all({file}, {.block_points = 999});
  EXPECT_EQ(points.info.points, kVertices);
  EXPECT_EQ(points.points.positions, expected);
  EXPECT_EQ(points.info.coordinates[0].type, ScalarType::f64);
  const AllPoints triangles =
      read_all({file}, {.entities = Entities::triangles, .block_points = 1000});
  ASSERT_EQ(triangles.points.size(), corners.size() / 3);
  for (std::size_t t = 0; t < triangles.points.size(); ++t) {
    ASSERT_EQ(triangles.points.positions[t], expected[corners[3 * t]]);
    ASSERT_EQ(triangles.values<double>(0)[t], expected[corners[3 * t + 1]][0]);
    ASSERT_EQ(triangles.values<double>(3)[t], expected[corners[3 * t + 2]][0]);
  }
}

TEST_F(GlbFiles, SkipsAndCountsVerticesWithNaN) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  for (const bool moved : {false, true}) {
    GlbMaker glb;
    const std::uint64_t positions =
        glb.add_positions({{0, 0, 0}, {1, kNan, 0}, {0, 1, 0}, {1, 1, 0}});
    glb.add_mesh({{"attributes", {{"POSITION", positions}}},
                  {"indices", glb.add_indices({0, 1, 2, 0, 3, 2}, 1)}},
                 {{"translation", {moved ? 1 : 0, 0, 0}}});
    const std::string file = put(glb.bytes());
    for (const Entities entities : {Entities::points, Entities::triangles}) {
      const auto source = open_source(std::array{file}, {.entities = entities});
      EXPECT_EQ(read_all(*source).points.size(), entities == Entities::points ? 3U : 1U);
      EXPECT_EQ(source->progress().nodata, 1U);
    }
    const std::optional<MeshFile> mesh = read_mesh(file);
    ASSERT_TRUE(mesh);
    EXPECT_EQ(mesh->vertices.size(), 3U);
    EXPECT_EQ(mesh->triangles.size(), 1U);
    EXPECT_EQ(mesh->nodata, 1U);
  }
  GlbMaker infinite;
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const std::uint64_t positions = infinite.add_positions({{0, kInfinity, 0}, {1, 0, 0}, {0, 1, 0}});
  infinite.add_mesh({{"attributes", {{"POSITION", positions}}}}, {{"translation", {1, 0, 0}}});
  const std::string file = put(infinite.bytes());
  EXPECT_NE(error_of([&] { read_all({file}); }).find("infinite"), std::string::npos);
}

TEST_F(GlbFiles, ErrorsNameTheFault) {
  const auto message = [&](const std::string& bytes) -> std::string {
    const std::string file = put(bytes);
    try {
      (void)read_mesh(file, {.format = "glb"});
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("mesh.glb"), std::string::npos) << error.what();
      return error.what();
    }
    return "";
  };
  GlbMaker good;
  const std::uint64_t positions = good.add_positions({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
  good.add_mesh(
      {{"attributes", {{"POSITION", positions}}}, {"indices", good.add_indices({0, 1, 2}, 1)}});
  good.add_accessor(0, 3, 5126, "SCALAR");
  EXPECT_EQ(message(good.bytes()), "");
  const std::string bytes = good.bytes();
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    EXPECT_NE(message(bytes.substr(0, length)), "") << length;
  }
  const auto with = [&](const char* path, const GlbJson& value) {
    GlbMaker bad = good;
    bad.json[GlbJson::json_pointer(path)] = value;
    return bad.bytes();
  };
  std::string old = bytes;
  old[4] = 1;
  for (const auto& [content, words] : std::vector<std::pair<std::string, std::string>>{
           {old, "glTF of version 1"},
           {good.bytes_of("[]"), "not an object"},
           {good.bytes_of("{\"a\": }"), "not JSON"},
           {good.bytes_of("{\"a\": 1e999}"), "too large for a double"},
           {good.bytes_of(std::string(100, '[') + std::string(100, ']')), "nested too deeply"},
           {with("/extensionsRequired", {"KHR_draco_mesh_compression"}), "KHR_draco"},
           {with("/accessors/0/count", 4), "extends beyond"},
           {with("/accessors/0/count", 4294967295), "extends beyond"},
           {with("/accessors/0/byteOffset", 4), "extends beyond"},
           {with("/accessors/0/count", -1), "is not a number"},
           {with("/accessors/0/count", 0), "which does not exist"},
           {with("/accessors/0/componentType", 5125), "not floats"},
           {with("/accessors/0/componentType", 5130), "not supported"},
           {with("/accessors/0/type", "VEC2"), "VEC3"},
           {with("/accessors/0/sparse", GlbJson::object()), "sparse"},
           {with("/meshes/0/primitives/0/indices", 0), "SCALAR"},
           {with("/meshes/0/primitives/0/indices", 2), "floats"},
           {with("/accessors/1/count", 2), "not three for each"},
           {with("/bufferViews/0/byteStride", 4), "overlap"},
           {with("/bufferViews/0/byteOffset", 4294967295), "extends beyond"},
           {with("/bufferViews/0/byteLength", 4294967295), "extends beyond"},
           {with("/bufferViews/0/buffer", 1), "another file"},
           {with("/buffers", {{{"byteLength", 1}, {"uri", "a.bin"}}}), "another file"},
           {with("/meshes/0/primitives/0/mode", 7), "does not have"},
           {with("/meshes/0/primitives/0/indices", 9), "is missing"},
           {with("/nodes/0/mesh", 1), "is missing"},
           {with("/nodes/0/children", {0}), ""},
           {with("/nodes/0/matrix", {1, 2}), "16 numbers"},
           {with("/nodes/0/translation", {1, 2, "a"}), "not a list of numbers"},
           {with("/scenes", {{{"nodes", {0, 0}}}}), "in the scene twice"},
           {with("/scenes", {{{"nodes", {1}}}}), "is missing"},
           {with("/scenes", 3), "not a list"}}) {
    const std::string error = message(content);
    EXPECT_NE(error.find(words), std::string::npos) << words << ": " << error;
  }
  // A node that is its own child is not a root, so the mesh has no faces.
  EXPECT_FALSE(read_mesh(put(with("/nodes/0/children", {0}))));
}

TEST_F(GlbFiles, SurvivesDamage) {
  GlbMaker glb;
  const std::uint64_t positions = glb.add_positions({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, 16);
  glb.add_mesh(
      {{"attributes", {{"POSITION", positions}}}, {"indices", glb.add_indices({0, 1, 2}, 2)}},
      {{"scale", {1, 2, 3}}});
  const std::string good = glb.bytes();
  std::mt19937_64 random(42);
  std::size_t read = 0;
  for (int trial = 0; trial < 3000; ++trial) {
    SCOPED_TRACE("seed 42, trial " + std::to_string(trial));
    std::string bad = good;
    for (int i = 0; i < 2; ++i) bad[random() % bad.size()] = static_cast<char>(random() % 128);
    try {
      const auto mesh = read_mesh(put(bad), {.format = "glb"});
      if (!mesh) continue;
      ++read;
      for (const TriangleIndices& t : mesh->triangles) {
        for (const std::uint32_t v : t) ASSERT_LT(v, mesh->vertices.size());
      }
    } catch (const Error&) {
    }
  }
  EXPECT_GT(read, 0U);
}

}  // namespace
}  // namespace terrace::stream
