// SPDX-License-Identifier: Apache-2.0
#include "format/mesh/triangles.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "format/missing.hpp"
#include "io/distinct_names.hpp"
#include "io/spool.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace {

/// Vertices by number, in a temporary file with a cache of pages: faces mostly name vertices near
/// those of the previous face.
class VertexTable {
 public:
  explicit VertexTable(std::string name) : name_(std::move(name)), slots_(kSlots) {}

  void append(const Point3& vertex) {
    if (tail_.size() == kPage) flush();
    tail_.push_back(vertex);
    ++count_;
  }

  [[nodiscard]] Point3 operator[](std::uint32_t number) {
    assert(number < count_);
    const std::uint64_t page = number / kPage;
    if (page == (count_ - 1) / kPage) return tail_[number % kPage];
    Slot& slot = slots_[page % kSlots];
    if (slot.page != page) {
      slot.page = kNone;  // in case reading fails
      slot.vertices.resize(kPage);
      spool_->read(page * kPage * sizeof(Point3), std::as_writable_bytes(std::span(slot.vertices)));
      slot.page = page;
    }
    return slot.vertices[number % kPage];
  }

 private:
  static constexpr std::size_t kPage = 1024, kSlots = 680;  // 24 KiB each
  static constexpr std::uint64_t kNone = std::numeric_limits<std::uint64_t>::max();

  struct Slot {
    std::uint64_t page = kNone;
    std::vector<Point3> vertices;
  };

  void flush() {
    if (!spool_) spool_.emplace(name_);
    spool_->append(std::as_bytes(std::span(tail_)));
    tail_.clear();
  }

  std::string name_;
  std::optional<Spool> spool_;
  std::vector<Slot> slots_;
  std::vector<Point3> tail_;  ///< the last page, not yet in the file
  std::uint64_t count_ = 0;
};

/// Delivers the triangles of a mesh as entities of three corners.
class TriangleSource final : public PointSource {
 public:
  TriangleSource(OpenMesh mesh, const SourceOptions& options)
      : mesh_(std::move(mesh)),
        block_points_(options.block_points),
        needs_faces_(options.needs_faces),
        type_(mesh_.parser->coordinate_type()),
        vertices_(mesh_.parser->input().name()) {
    info_.format = mesh_.parser->format();
    info_.files = {mesh_.parser->input().name()};
    if (mesh_.parser->is_soup() && mesh_.parser->stated_vertices()) {
      info_.points = *mesh_.parser->stated_vertices() / 3;
    }
    constexpr std::array kNames{"x", "y", "z"};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      info_.coordinates[axis] = {.name = kNames[axis], .type = type_};
    }
    for (const char* const corner : {"2", "3"}) {
      for (const char* const name : kNames) {
        info_.attributes.push_back({.name = std::string(name) + corner, .type = type_});
      }
    }
    DistinctNames distinct;
    for (const Channel& coordinate : info_.coordinates) distinct.add(coordinate.name);
    for (const Channel& corner : info_.attributes) distinct.add(corner.name);
    for (Channel& property : mesh_.parser->face_properties()) {
      property.name = distinct.add(property.name);
      info_.attributes.push_back(std::move(property));
    }
    if (options.crs) info_.crs = *options.crs;
  }

  const SourceInfo& info() const override { return info_; }

  bool next(PointBlock& block) override {
    block.clear();
    while (block.size() < block_points_) {
      if (fan_ < mesh_.parser->face().size() && in_face_) {
        const std::vector<std::uint32_t>& face = mesh_.parser->face();
        append(block, corner(face[0]), corner(face[fan_ - 1]), corner(face[fan_]));
        ++fan_;
        continue;
      }
      in_face_ = false;
      const MeshParser::Item item = mesh_.parser->next();
      if (item == MeshParser::Item::end) break;
      if (item == MeshParser::Item::face) {
        in_face_ = true;
        fan_ = 2;
      } else if (mesh_.parser->is_soup()) {
        soup_[soup_size_++ % 3] = mesh_.parser->vertex();
      } else {
        vertices_.append(mesh_.parser->vertex());
      }
    }
    delivered_ += block.size();
    if (needs_faces_ && delivered_ + nodata_ == 0) {
      throw Error(info_.files.front(), "has no faces, so it has no triangles")
          .remedy(message("read it as points: leave {entities} out"));
    }
    return !block.empty();
  }

  Progress progress() const override {
    Progress progress{.points = delivered_, .nodata = nodata_};
    const Input& input = mesh_.parser->input();
    if (input.size() && *input.size() > 0) {
      progress.fraction =
          std::min(1.0, static_cast<double>(input.offset()) / static_cast<double>(*input.size()));
    }
    return progress;
  }

 private:
  [[nodiscard]] Point3 corner(std::uint32_t number) {
    return mesh_.parser->is_soup() ? soup_[number % 3] : vertices_[number];
  }

  void append(PointBlock& block, const Point3& a, const Point3& b, const Point3& c) {
    if (is_missing(a) || is_missing(b) || is_missing(c)) {
      ++nodata_;
      return;
    }
    block.positions.push_back(a);
    for (const Point3& point : {b, c}) {
      for (const double value : point) {
        std::array<std::byte, sizeof(double)> bytes{};
        if (type_ == ScalarType::f32) {
          const auto narrow = static_cast<float>(value);  // exact: it was a float
          std::memcpy(bytes.data(), &narrow, sizeof narrow);
        } else {
          std::memcpy(bytes.data(), &value, sizeof value);
        }
        block.payload.insert(block.payload.end(), bytes.begin(),
                             bytes.begin() + static_cast<std::ptrdiff_t>(size_of(type_)));
      }
    }
    const std::span<const std::byte> properties = mesh_.parser->face_record();
    block.payload.insert(block.payload.end(), properties.begin(), properties.end());
  }

  OpenMesh mesh_;
  std::size_t block_points_;
  bool needs_faces_;
  ScalarType type_;
  SourceInfo info_;
  VertexTable vertices_;
  std::array<Point3, 3> soup_{};  ///< the last corners, if vertices are not shared
  std::uint64_t soup_size_ = 0, delivered_ = 0, nodata_ = 0;
  std::size_t fan_ = 0;  ///< the last corner of the next triangle of the face
  bool in_face_ = false;
};

}  // namespace

std::unique_ptr<PointSource> triangles_of(OpenMesh mesh, const SourceOptions& options) {
  return std::make_unique<TriangleSource>(std::move(mesh), options);
}

}  // namespace terrace::stream
