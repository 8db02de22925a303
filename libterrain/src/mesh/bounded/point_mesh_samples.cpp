// SPDX-License-Identifier: Apache-2.0
#include "mesh/bounded/point_mesh_samples.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <numeric>
#include <string>
#include <utility>

#include <terrace/stream/error.hpp>

#include "base/streaming_hull.hpp"
#include "terrace/terrain/detail.hpp"

namespace terrace::terrain {
namespace {

constexpr std::size_t kBufferBytes = std::size_t{16} << 20;
constexpr std::size_t kMinChunk = 40, kMaxChunk = 4096;  // in points

std::filesystem::path place_for(const std::string& path) {
  if (path != "-") return path + ".samples";
  return std::filesystem::temp_directory_path() / "terrace.samples";
}

constexpr std::size_t kMaxPlaces = std::size_t{1} << 20;
/// The limit of tri::point_tin(); products of two such numbers are finite.
constexpr double kLargest = 1e100;

/// As for_each_wanted_place(), with converted places.
void for_each_sample(const stream::Store& store, const Detail& detail, unsigned threads,
                     const PlaceConversion& places,
                     const std::function<void(std::span<const stream::Point3>)>& show) {
  if (!places.has_effect()) return for_each_wanted_place(store, detail, threads, show);
  std::vector<stream::Point3> moved;
  for_each_wanted_place(store, detail, threads, [&](std::span<const stream::Point3> placed) {
    moved.assign(placed.begin(), placed.end());
    places(std::span<stream::Point3>(moved));
    show(moved);
  });
}

/// Drops every other place.
void thin_out(std::vector<Point2>& places) {
  for (std::size_t i = 0; 2 * i < places.size(); ++i) places[i] = places[2 * i];
  places.resize((places.size() + 1) / 2);
}

}  // namespace

PointMeshSamples::PointMeshSamples(const stream::Store& store, const Detail& detail,
                                   const PointMeshCuts& cuts, const std::string& path,
                                   unsigned threads, const PlaceConversion& places)
    : store_(store),
      cuts_(cuts),
      file_(place_for(path), true),
      chunk_points_(std::clamp(kBufferBytes / sizeof(stream::Point3) / cuts.cells.size(), kMinChunk,
                               kMaxChunk)),
      counts_(cuts.cells.size(), 0),
      waiting_(cuts.cells.size()),
      chunks_(cuts.cells.size()) {
  for_each_sample(store, detail, threads, places, [&](std::span<const stream::Point3> samples) {
    for (const stream::Point3& p : samples) deal(cuts.cell_of({p[0], p[1]}), p);
  });
  // Keep the rest without spare capacity, and flush the file's buffer.
  for (std::vector<stream::Point3>& rest : waiting_) rest.shrink_to_fit();
  file_.read_at(0, {});
}

void PointMeshSamples::deal(std::size_t cell, const stream::Point3& p) {
  std::vector<stream::Point3>& waiting = waiting_[cell];
  if (waiting.capacity() < chunk_points_) waiting.reserve(chunk_points_);
  waiting.push_back(p);
  ++counts_[cell];
  if (waiting.size() < chunk_points_) return;
  file_.write(std::as_bytes(std::span(waiting)));
  chunks_[cell].push_back(written_++);
  waiting.clear();
}

std::size_t PointMeshSamples::count(std::uint32_t first_cell, std::uint32_t cells) const {
  const auto first = counts_.begin() + first_cell;
  return std::accumulate(first, first + cells, std::size_t{0});
}

void PointMeshSamples::read(std::uint32_t first_cell, std::uint32_t cells, const PlaneBox& box,
                            MeshSamples& out) {
  for (std::uint32_t cell = first_cell; cell < first_cell + cells; ++cell) {
    if (cuts_.cells[cell].box.meets(box)) read_cell(cell, box, out);
  }
}

void PointMeshSamples::read_cell(std::size_t cell, const PlaneBox& box, MeshSamples& out) {
  const auto take = [&](std::span<const stream::Point3> points) {
    for (const stream::Point3& p : points) {
      if (box.contains({p[0], p[1]})) out.add(p);
    }
  };
  store_.check_stop();
  std::vector<stream::Point3> chunk(chunk_points_);
  const auto bytes = std::as_writable_bytes(std::span(chunk));
  for (const std::uint32_t number : chunks_[cell]) {
    std::size_t read_bytes = 0;
    {
      const std::lock_guard lock(mutex_);
      read_bytes = file_.read_at(std::uint64_t{number} * bytes.size(), bytes);
    }
    if (read_bytes != bytes.size()) {
      throw stream::Error(file_.target().string(), "a temporary file was truncated while in use")
          .at_byte(number * bytes.size())
          .remedy("check the disk and run again");
    }
    take(chunk);
  }
  take(waiting_[cell]);
}

PointMeshScan scan_point_mesh(const stream::Store& store, const Detail& detail, std::size_t few,
                              unsigned threads, const PlaceConversion& places) {
  PointMeshScan scan;
  scan.all.emplace();
  StreamingHull hull;
  const auto add = [&](const stream::Point3& p) {
    if (!(std::abs(p[0]) < kLargest && std::abs(p[1]) < kLargest && std::abs(p[2]) < kLargest)) {
      throw stream::Error(store.path().string(),
                          "a point has a coordinate that is not finite or exceeds 1e100")
          .remedy(stream::message("leave it out of the store, or of the {region}"));
    }
    if (scan.samples % scan.period == 0) {
      if (scan.sample.size() == kMaxPlaces) {
        thin_out(scan.sample);
        scan.period *= 2;
      }
      if (scan.samples % scan.period == 0) scan.sample.push_back({p[0], p[1]});
    }
    ++scan.samples;
    hull.add({p[0], p[1]});
    if (!scan.all) return;
    if (scan.samples > few) {
      scan.all.reset();
    } else {
      scan.all->add(p);
    }
  };
  for_each_sample(store, detail, threads, places, [&](std::span<const stream::Point3> samples) {
    for (const stream::Point3& p : samples) add(p);
  });
  if (scan.all) {
    scan.sample = {};
  } else {
    scan.hull = hull.corners();
  }
  return scan;
}

}  // namespace terrace::terrain
