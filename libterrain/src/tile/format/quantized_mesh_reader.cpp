// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>
#include <cstring>

#include <fmt/core.h>
#include <terrace/stream/error.hpp>

#include "base/units.hpp"
#include "tile/format/quantized_mesh.hpp"

namespace terrace::terrain {
namespace {

class Reader {
 public:
  Reader(std::span<const std::byte> bytes, const std::string& name) : bytes_(bytes), name_(name) {}

  [[nodiscard]] std::size_t left() const { return bytes_.size() - at_; }

  [[nodiscard]] stream::Error fault(std::string cause) const {
    return stream::Error(name_, std::move(cause))
        .at_byte(at_)
        .remedy("the tile is damaged: make it again");
  }
  // Throws unless that many values are left. Call it before allocating memory for them.
  void need(std::uint64_t count, std::size_t size, const char* what) const {
    if (count > left() / size) {
      throw fault(fmt::format("{} {} of {}, but only {} {} left", count, what,
                              counted(size, "byte"), counted(left(), "byte"),
                              left() == 1 ? "is" : "are"));
    }
  }
  template <class T>
  T get(const char* what) {
    need(1, sizeof(T), what);
    T value;
    std::memcpy(&value, bytes_.data() + at_, sizeof(T));
    at_ += sizeof(T);
    return value;
  }
  double finite(const char* what) {
    const auto value = get<double>(what);
    if (!std::isfinite(value)) throw fault(fmt::format("{} is not finite", what));
    return value;
  }
  stream::Point3 point(const char* what) {
    stream::Point3 p;
    for (double& c : p) c = finite(what);
    return p;
  }
  void align(std::size_t to) {
    while (at_ % to != 0) get<std::byte>("padding");
  }
  std::span<const std::byte> take(std::size_t count) {
    const auto piece = bytes_.subspan(at_, count);
    at_ += count;
    return piece;
  }

 private:
  std::span<const std::byte> bytes_;
  const std::string& name_;
  std::size_t at_ = 0;
};

std::vector<std::uint16_t> read_column(Reader& in, std::size_t count, const char* what) {
  in.need(count, sizeof(std::uint16_t), what);
  std::vector<std::uint16_t> values(count);
  int value = 0;
  for (std::uint16_t& out : values) {
    const unsigned code = in.get<std::uint16_t>(what);
    value += static_cast<int>(code >> 1) ^ -static_cast<int>(code & 1);
    if (value < 0 || value > kTileUnits) throw in.fault(fmt::format("{} outside 0 to 32767", what));
    out = static_cast<std::uint16_t>(value);
  }
  return values;
}

template <class Index>
void read_triangles(Reader& in, TileMesh& mesh) {
  const auto count = in.get<std::uint32_t>("number of triangles");
  in.need(count, 3 * sizeof(Index), "triangles");
  mesh.triangles.resize(count);
  std::uint32_t highest = 0;
  for (auto& triangle : mesh.triangles) {
    for (std::uint32_t& vertex : triangle) {
      const auto code = std::uint32_t{in.get<Index>("index")};
      if (code > highest) throw in.fault("index before the first vertex");
      vertex = highest - code;
      if (code == 0) ++highest;
      if (vertex >= mesh.size()) throw in.fault("index beyond the last vertex");
    }
  }
}

template <class Index>
std::vector<std::uint32_t> read_edge(Reader& in, std::size_t vertices) {
  const auto count = in.get<std::uint32_t>("number of edge vertices");
  in.need(count, sizeof(Index), "edge vertices");
  std::vector<std::uint32_t> list(count);
  for (std::uint32_t& vertex : list) {
    vertex = in.get<Index>("edge vertex");
    if (vertex >= vertices) throw in.fault("edge vertex beyond the last vertex");
  }
  return list;
}

template <class Index>
void read_indices(Reader& in, DecodedTile& tile) {
  read_triangles<Index>(in, tile.mesh);
  for (auto* list : {&tile.edges.west, &tile.edges.south, &tile.edges.east, &tile.edges.north}) {
    *list = read_edge<Index>(in, tile.mesh.size());
  }
}

void read_extension(Reader& in, TileMesh& mesh) {
  const auto id = in.get<std::uint8_t>("extension");
  const auto length = in.get<std::uint32_t>("length of an extension");
  in.need(length, 1, "bytes of an extension");
  switch (static_cast<TileExtension>(id)) {
    case TileExtension::oct_normals:
      if (!mesh.normals.empty()) throw in.fault("duplicate normals");
      if (length != 2 * mesh.size()) throw in.fault("normals for another number of vertices");
      for (std::size_t i = 0; i < mesh.size(); ++i) {
        const auto code = in.get<std::array<std::uint8_t, 2>>("normal");
        mesh.normals.push_back(oct_decode(code));
      }
      return;
    case TileExtension::water_mask:
      if (!mesh.water.empty()) throw in.fault("duplicate water mask");
      if (length != 1 && length != kWaterCells) {
        throw in.fault("a water mask that has neither 1 nor 65536 bytes");
      }
      for (std::size_t i = 0; i < length; ++i) {
        mesh.water.push_back(in.get<std::uint8_t>("water mask"));
      }
      return;
    case TileExtension::metadata: {
      const auto size = in.get<std::uint32_t>("length of the metadata");
      if (length < sizeof(size) || size != length - sizeof(size)) {
        throw in.fault("metadata and its extension have different lengths");
      }
      const auto text = in.take(size);
      mesh.metadata.assign(reinterpret_cast<const char*>(text.data()), text.size());
      return;
    }
    default:
      // Readers skip unknown extensions.
      in.take(length);
  }
}

}  // namespace

DecodedTile decode_tile(std::span<const std::byte> bytes, const std::string& name) {
  Reader in(bytes, name);
  DecodedTile tile;
  TileMesh& mesh = tile.mesh;
  tile.header.centre = in.point("centre");
  mesh.lowest = in.get<float>("lowest height");
  mesh.highest = in.get<float>("highest height");
  if (!std::isfinite(mesh.lowest) || !std::isfinite(mesh.highest) || mesh.lowest > mesh.highest) {
    throw in.fault("lowest and highest height are not finite and in order");
  }
  tile.header.sphere.centre = in.point("centre of the bounding sphere");
  tile.header.sphere.radius = in.finite("radius of the bounding sphere");
  tile.header.horizon_occlusion = in.point("horizon occlusion point");

  const auto vertices = in.get<std::uint32_t>("number of vertices");
  in.need(vertices, 3 * sizeof(std::uint16_t), "vertices");
  mesh.u = read_column(in, vertices, "u");
  mesh.v = read_column(in, vertices, "v");
  mesh.height = read_column(in, vertices, "height");
  if (vertices > kMaxShortVertices) {
    in.align(sizeof(std::uint32_t));
    read_indices<std::uint32_t>(in, tile);
  } else {
    read_indices<std::uint16_t>(in, tile);
  }
  while (in.left() > 0) read_extension(in, mesh);
  return tile;
}

}  // namespace terrace::terrain
