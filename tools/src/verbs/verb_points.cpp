// SPDX-License-Identifier: GPL-3.0-or-later
#include <cstddef>
#include <cstring>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <terrace/stream/overlay.hpp>
#include <terrace/stream/point_writer.hpp>
#include <terrace/stream/store.hpp>

#include "base/units.hpp"
#include "cli/crs_options.hpp"
#include "cli/detail_options.hpp"
#include "cli/interrupt.hpp"
#include "cli/output.hpp"
#include "mesh/height_overlay.hpp"
#include "terrace/terrain/detail.hpp"
#include "verbs/verbs.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

/// Points inside the wanted part, on their way to the writer. A point comes back if its level is
/// wanted where it lies: with a region, only what is inside it or inside a focus. An overlay's
/// heights come in place of the store's, which say what is inside.
class PointOutput {
 public:
  PointOutput(const stream::Store& store, const Detail& detail, PlaceConversion places,
              stream::Overlay* overlay, stream::PointWriter& writer)
      : schema_(store.schema()),
        detail_(detail),
        places_(std::move(places)),
        overlay_(overlay),
        writer_(writer) {}

  void add(stream::ClusterId id, const stream::ClusterRecord& record,
           const stream::ClusterPoints& points) {
    check_interrupt();
    std::span<const stream::OverlayValue> heights;
    if (overlay_ != nullptr) heights = overlay_->find(id);
    std::size_t next = 0;
    const std::size_t payload = schema_.payload_size();
    const bool whole = !detail_.region || detail_.region->overlap(world_box(
                                              schema_, record.summary.box)) == Overlap::whole;
    for (std::size_t i = 0; i < points.size(); ++i) {
      stream::Point3 p = world_point(schema_, points.positions[i]);
      while (next < heights.size() && heights[next].index < i) ++next;
      if (!whole && !inside(p)) continue;
      if (next < heights.size() && heights[next].index == i) {
        p[2] = heights[next].value;
        ++replaced_;
      }
      block_.positions.push_back(p);
      const std::byte* values = points.payload.data() + i * payload;
      block_.payload.insert(block_.payload.end(), values, values + payload);
    }
    if (block_.size() >= kPointsPerBlock) flush();
  }

  void flush() {
    places_(block_.positions);
    if (!block_.empty()) writer_.append(block_);
    block_.clear();
  }

  /// Heights that are the overlay's.
  [[nodiscard]] std::uint64_t replaced() const { return replaced_; }

 private:
  static constexpr std::size_t kPointsPerBlock = 65536;

  [[nodiscard]] bool inside(const stream::Point3& p) const {
    if (detail_.region->contains(p)) return true;
    for (const FinerRegion& focus : detail_.focuses) {
      if (focus.region.contains(p)) return true;
    }
    return false;
  }

  const stream::StoreSchema& schema_;
  const Detail& detail_;
  PlaceConversion places_;
  stream::Overlay* overlay_;
  stream::PointWriter& writer_;
  stream::PointBlock block_;
  std::uint64_t replaced_ = 0;
};

class PointsCommand final : public Command {
 public:
  void define(CLI::App& app) override {
    app.add_option("STORE", store_, "where the points come from")->required();
    add_output(app, output_, "the file to write: .xyz, .csv, .ply; - is standard output");
    app.add_option("--format", format_, "xyz, csv, ply, ply-ascii; else by the file's ending");
    app.add_option("--level", level_, "points of this level and above: a number or top")
        ->default_str("0; with --focus top");
    app.add_option(
        "--region", region_,
        "only points inside: a box, minx,miny[,minz],maxx,maxy[,maxz], or a GeoJSON file");
    app.add_option("--focus", focuses_,
                   "BOX:L, points of level L and above inside the box; repeatable")
        ->allow_extra_args(false);
    app.add_option("--overlay", overlay_,
                   "a file of mesh --save-overlay: its heights in place of the store's")
        ->type_name("FILE");
    crs_.define(app);
    not_yet(app, {"--max-points"});
  }

  Summary run(const CommonOptions& common) override {
    const Stopwatch watch;
    const stream::Store store = open_store(store_);
    const Detail detail =
        parse_detail(store, level_, region_, focuses_, crs_.regions(store, common));
    std::optional<stream::Overlay> overlay;
    if (!overlay_.empty()) overlay.emplace(open_height_overlay(overlay_, store));
    const auto writer = stream::open_point_writer(
        output_, {.attributes = store.schema().attributes, .comments = {kWriterMark}},
        {.format = format_, .replace = may_replace(output_, common.force), .stop = stop_token()});
    PointOutput output(store, detail, crs_.places(store, common), overlay ? &*overlay : nullptr,
                       *writer);
    for_each_wanted(
        store, detail,
        [&output](stream::ClusterId id, const stream::ClusterRecord& record,
                  const stream::ClusterPoints& points) { output.add(id, record, points); });
    output.flush();
    const std::uint64_t points = writer->points();
    writer->finish();

    Summary summary;
    summary.json = {{"vertices", points},
                    {"triangles", 0},
                    {"seconds", watch.seconds()},
                    {"peak_rss_bytes", peak_rss_bytes()}};
    summary.text = output_ + ": " + with_commas(points) + " points in " +
                   readable_seconds(watch.seconds()) + "\n";
    if (overlay) {
      summary.json["overlay_values"] = output.replaced();
      summary.text += with_commas(output.replaced()) + " heights from " + overlay_ + "\n";
    }
    return summary;
  }

 private:
  std::string store_, output_, format_, level_, region_, overlay_;
  std::vector<std::string> focuses_;
  CrsOptions crs_;
};

}  // namespace

std::unique_ptr<Command> make_points() { return std::make_unique<PointsCommand>(); }

}  // namespace terrace::tools
