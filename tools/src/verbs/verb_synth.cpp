// SPDX-License-Identifier: GPL-3.0-or-later
// synth: test inputs of any size.
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/core.h>

#include "base/parallel.hpp"
#include "base/units.hpp"
#include "cli/interrupt.hpp"
#include "cli/output.hpp"
#include "picture/canvas.hpp"
#include "synth/synth_cloud.hpp"
#include "synth/synth_dem.hpp"
#include "tables/point_table.hpp"
#include "terrace/stream/point_writer.hpp"
#include "terrace/terrain/crs.hpp"
#include "terrace/terrain/error.hpp"
#include "terrace/terrain/output_kinds.hpp"
#include "verbs/verbs.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

class SynthCommand final : public Command {
 public:
  void define(CLI::App& app) override {
    app.add_option(
           "kind", kind_,
           "dem: fractal terrain (GeoTIFF); surface: scan of a bumpy body; uniform: a cube; "
           "clusters: blobs")
        ->required()
        ->check(CLI::IsMember({"dem", "surface", "uniform", "clusters"}))
        ->type_name("KIND");
    add_output(app, output_, "the file to write; for points its ending selects the format");
    size_option_ = app.add_option("--size", size_, "dem: columns x rows")
                       ->capture_default_str()
                       ->type_name("WxH");
    points_option_ =
        app.add_option("--points", points_, "number of points (default: 1M)")->type_name("N");
    add_number(app, "--cell", dem_.cell, "dem: side of a cell, in units of the CRS", kPositive);
    add_number(app, "--hurst", dem_.hurst, "dem: smoothness, between 0 and 1",
               {.min = 0.01, .max = 0.99});
    add_number(app, "--roughness", dem_.roughness,
               "dem: RMS difference of neighbouring cells in metres, at any size", kNonNegative);
    app.add_option("--type", type_, "dem: int16 or float32")
        ->capture_default_str()
        ->check(CLI::IsMember({"int16", "float32"}));
    app.add_option("--crs", crs_, "dem: EPSG code to write")
        ->capture_default_str()
        ->type_name("EPSG:n");
    app.add_option("--compress", dem_.compression, "dem: none, deflate or zstd")
        ->capture_default_str()
        ->check(CLI::IsMember({"none", "deflate", "zstd"}));
    shuffle_option_ = app.add_option("--shuffle", shuffle_,
                                     "order of points: all (every point anywhere) or "
                                     "pieces:MIN-MAX (runs of that many points)")
                          ->type_name("HOW");
  }

  Summary run(const CommonOptions& common) override {
    const bool dem = kind_ == "dem";
    check_output_name(dem ? outputs::kRasterFile : outputs::kPointFile, output_);
    if (dem && (points_option_->count() > 0 || shuffle_option_->count() > 0)) {
      throw UsageError("synth dem takes --size, not --points or --shuffle");
    }
    if (!dem && size_option_->count() > 0) {
      throw UsageError(fmt::format("synth {} takes --points, not --size", kind_));
    }
    return dem ? make_dem(common) : make_cloud(common);
  }

 private:
  Summary make_dem(const CommonOptions& common) {
    const Stopwatch watch;
    dem_.size = parse_size(size_);
    dem_.crs = crs_named(crs_);
    dem_.crs.name.clear();  // the code is enough
    dem_.floats = type_ == "float32";
    dem_.seed = common.seed;
    dem_.threads = common.threads;
    dem_.memory_bytes = common.memory_or(kStreamingMemory);
    dem_.replace = may_replace(output_, common.force);
    const std::uint64_t cells = dem_.size.width * dem_.size.height;
    SynthDemResult result;
    {
      ProgressMeter meter(common.progress, "cells");
      result = write_synth_dem(output_, dem_, [&](std::uint64_t done) {
        meter.update(done, static_cast<double>(done) / static_cast<double>(cells));
      });
    }
    Summary summary;
    summary.json = {{"points", cells},
                    {"columns", dem_.size.width},
                    {"rows", dem_.size.height},
                    {"height", {{"min", result.minimum}, {"max", result.maximum}}},
                    {"rms_step", result.rms_step},
                    {"bytes", result.bytes}};
    summary.add_cost(watch);
    summary.text =
        fmt::format("{}: {} x {} cells, heights {} to {}, RMS step {}, {}, {}\n", output_,
                    dem_.size.width, dem_.size.height, plain_number(std::round(result.minimum)),
                    plain_number(std::round(result.maximum)), readable_number(result.rms_step),
                    readable_bytes(result.bytes), readable_seconds(watch.seconds()));
    return summary;
  }

  Summary make_cloud(const CommonOptions& common) {
    const Stopwatch watch;
    const std::uint64_t points = points_.empty() ? 1000000 : count_of_option("--points", points_);
    const Cloud cloud = kind_ == "surface"   ? surface_cloud(points, common.seed)
                        : kind_ == "uniform" ? uniform_cloud(common.seed)
                                             : cluster_cloud(points, common.seed);
    const DeliveryOrder order(shuffle_, points, common.seed, common.memory_or(kStreamingMemory));
    const auto writer =
        stream::open_point_writer(output_, {.attributes = {}, .comments = {kWriterMark}},
                                  point_writer_options(output_, {}, common));
    writing_within_memory(*writer, output_, common.memory_or(0));
    {
      ProgressMeter meter(common.progress, "points");
      stream::PointBlock block;
      constexpr std::uint64_t kBatch = 1 << 16;
      for (std::uint64_t first = 0; first < points; first += kBatch) {
        check_interrupt();
        block.positions.resize(std::min(kBatch, points - first));
        parallel_bands(static_cast<std::uint32_t>(block.size()), common.threads,
                       [&](std::uint32_t begin, std::uint32_t end) {
                         for (std::uint32_t i = begin; i < end; ++i) {
                           block.positions[i] = cloud(order(first + i));
                         }
                       });
        writer->append(block);
        meter.update(first + block.size(),
                     static_cast<double>(first + block.size()) / static_cast<double>(points));
      }
    }
    writer->finish();
    std::error_code ignored;
    const std::uintmax_t bytes = output_ == "-" ? 0 : std::filesystem::file_size(output_, ignored);
    Summary summary;
    summary.json = {{"points", points}, {"bytes", bytes}};
    summary.add_cost(watch);
    summary.text = fmt::format("{}: {}, {}\n", output_, counted(points, "point"),
                               readable_seconds(watch.seconds()));
    return summary;
  }

  std::string kind_, output_, size_ = "4096x4096", points_, type_ = "int16", crs_ = "EPSG:32632",
                              shuffle_;
  SynthDemOptions dem_;
  CLI::Option* size_option_ = nullptr;
  CLI::Option* points_option_ = nullptr;
  CLI::Option* shuffle_option_ = nullptr;
};

}  // namespace

std::unique_ptr<Command> make_synth() { return std::make_unique<SynthCommand>(); }

}  // namespace terrace::tools
