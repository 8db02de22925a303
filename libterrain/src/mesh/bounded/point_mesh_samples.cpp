// SPDX-License-Identifier: Apache-2.0
#include "mesh/bounded/point_mesh_samples.hpp"

#include <algorithm>
#include <filesystem>
#include <numeric>

#include <terrace/stream/error.hpp>

#include "terrace/terrain/detail.hpp"

namespace terrace::terrain {
namespace {

constexpr std::size_t kBufferBytes = std::size_t{16} << 20;
constexpr std::size_t kLeastChunk = 40, kMostChunk = 4096;  // points

std::filesystem::path place_for(const std::string& path) {
  if (path != "-") return path + ".samples";
  return std::filesystem::temp_directory_path() / "terrace.samples";
}

}  // namespace

double merged_height(std::span<const double> heights, tri::PointDuplicates duplicates) {
  double height = heights.front();
  if (duplicates == tri::PointDuplicates::kMin) {
    height = *std::min_element(heights.begin(), heights.end());
  } else if (duplicates == tri::PointDuplicates::kMax) {
    height = *std::max_element(heights.begin(), heights.end());
  } else if (duplicates == tri::PointDuplicates::kMean) {
    double sum = 0.0;
    for (const double other : heights) sum += other - heights.front();
    height += sum / static_cast<double>(heights.size());
  } else if (duplicates == tri::PointDuplicates::kAll) {
    const auto [low, high] = std::minmax_element(heights.begin(), heights.end());
    height = *low + (*high - *low) / 2.0;
  }
  return height;
}

void SharedPlaces::add(const MeshSamples& samples) {
  std::vector<std::uint32_t> order(samples.size());
  std::iota(order.begin(), order.end(), 0U);
  const auto place = [&](std::uint32_t i) { return Point2{samples.x[i], samples.y[i]}; };
  std::sort(order.begin(), order.end(),
            [&](std::uint32_t a, std::uint32_t b) { return place(a) < place(b); });
  for (std::size_t first = 0, end = 0; first < order.size(); first = end) {
    double low = samples.z[order[first]], high = low;
    for (end = first + 1; end < order.size() && place(order[end]) == place(order[first]); ++end) {
      low = std::min(low, samples.z[order[end]]);
      high = std::max(high, samples.z[order[end]]);
    }
    if (end - first == 1) continue;
    if (places == 0 || high - low > range) {
      range = high - low;
      widest = place(order[first]);
    }
    ++places;
  }
}

PointMeshSamples::PointMeshSamples(const stream::Store& store, const Detail& detail,
                                   const PointMeshCuts& cuts, const std::string& path)
    : cuts_(cuts),
      file_(place_for(path), true),
      chunk_points_(std::clamp(kBufferBytes / sizeof(stream::Point3) / cuts.cells.size(),
                               kLeastChunk, kMostChunk)),
      counts_(cuts.cells.size(), 0),
      waiting_(cuts.cells.size()),
      chunks_(cuts.cells.size()) {
  for_each_wanted_point(
      store, detail,
      [&](stream::ClusterId, const stream::ClusterPoints&, std::size_t, const stream::Point3& p) {
        deal(cuts.cell_of({p[0], p[1]}), p);
      });
  // What is left takes no more than its room; nothing is buffered any more.
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
  std::vector<stream::Point3> chunk(chunk_points_);
  const auto bytes = std::as_writable_bytes(std::span(chunk));
  for (const std::uint32_t number : chunks_[cell]) {
    std::size_t got = 0;
    {
      const std::lock_guard lock(mutex_);
      got = file_.read_at(std::uint64_t{number} * bytes.size(), bytes);
    }
    if (got != bytes.size()) {
      throw stream::Error({.file = file_.target().string(),
                           .where = "byte " + std::to_string(number * bytes.size()),
                           .cause = "a temporary file lost its end while it was in use",
                           .remedy = "look after the disk and run again"});
    }
    take(chunk);
  }
  take(waiting_[cell]);
}

}  // namespace terrace::terrain
