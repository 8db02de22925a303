// SPDX-License-Identifier: GPL-3.0-or-later
// Figure 7.5: distances from points to their facilities, for three orders of the same stream.
#include <array>
#include <cmath>
#include <memory>
#include <random>
#include <utility>

#include "setting.hpp"
#include "stream.hpp"

namespace terrace::research {

using namespace cluster;

namespace {

/// A set cut into pieces of random lengths, which are read in random order.
class Shuffled final : public PointSet {
 public:
  Shuffled(std::unique_ptr<PointSet> set, std::uint64_t shortest, std::uint64_t longest)
      : PointSet(set->size()), set_(std::move(set)) {
    std::mt19937_64 random(1);
    for (std::uint64_t first = 0; first < size();) {
      const std::uint64_t length =
          std::min(size() - first, shortest + random() % (longest - shortest + 1));
      pieces_.push_back({first, length});
      first += length;
    }
    for (std::size_t i = pieces_.size(); i > 1; --i) {
      std::swap(pieces_[i - 1], pieces_[random() % i]);
    }
  }

  /// Continues reading; `first` must be where the last call ended.
  void read(std::uint64_t, std::span<Point3> points) override {
    while (!points.empty()) {
      Piece& piece = pieces_[next_];
      const std::uint64_t count = std::min<std::uint64_t>(points.size(), piece.length);
      set_->read(piece.first, points.first(static_cast<std::size_t>(count)));
      points = points.subspan(static_cast<std::size_t>(count));
      piece.first += count;
      piece.length -= count;
      if (piece.length == 0) ++next_;
    }
  }

 private:
  struct Piece {
    std::uint64_t first, length;
  };
  std::unique_ptr<PointSet> set_;
  std::vector<Piece> pieces_;
  std::size_t next_ = 0;
};

constexpr std::size_t kBins = 100;

struct Histogram {
  std::array<std::uint64_t, kBins> counts{};
  std::uint64_t far = 0;  // points beyond a quarter of the facility cost
  std::uint64_t clusters = 0;

  void add(const StreamBlock& block) {
    const ClusteredBlock& b = block.block;
    clusters += b.representatives.size();
    for (std::size_t c = 0; c < b.representatives.size(); ++c) {
      const Point3& f = b.positions[b.representatives[c]];
      for (std::uint32_t k = b.first[c]; k < b.first[c + 1]; ++k) {
        const double share =
            distance(Euclidean{}, f, b.positions[b.order[k]]) / block.facility_cost;
        far += share > 0.25;
        ++counts[std::min(kBins - 1, static_cast<std::size_t>(share * static_cast<double>(kBins)))];
      }
    }
  }
};

}  // namespace

void figure_7_5(Setting& setting) {
  const NamedSet& named = large_sets()[3];
  const std::uint64_t points = setting.points(named.thesis_points);
  const std::size_t block = setting.block(10'000);
  const std::array<std::string, 3> names{
      "sequential", "pieces of 10-" + std::to_string(block),
      "pieces of " + std::to_string(block - 10) + "-" + std::to_string(block)};
  const std::array<const char*, 3> thesis{"-", "-", "551, < 0.01 %"};
  Plot plot{.title = "Distances to facilities for three orders of the stream (figure 7.5)",
            .x = {.label = "distance / facility cost", .low = 0.0, .high = 1.0},
            .y = {.label = "points", .log = true, .low = 0.7}};
  Table table{"figure-7.5",
              "Figure 7.5: order of the stream. " + grouped(points) + " points (" + named.name() +
                  "), blocks of " + grouped(block) +
                  ", facility cost 1 x diagonal, m ceil(log10 m) candidates.\n[..]: the thesis.",
              {"order", "seconds", "clusters", "beyond 0.25 fc", "share", "[beyond 0.25 fc]"}};
  Table data{"figure-7.5-histogram", "", {"from", "to", names[0], names[1], names[2]}};
  std::array<Histogram, 3> histograms;
  for (std::size_t order = 0; order < 3; ++order) {
    auto set = named.make(points);
    if (order > 0) {
      set = std::make_unique<Shuffled>(std::move(set), order == 1 ? 10 : block - 10, block);
    }
    Histogram& histogram = histograms[order];
    StreamOptions options;
    options.block = block;
    options.effort = Effort::fine;
    StreamClustering stream(options, [&](const StreamBlock& b) { histogram.add(b); });
    run(*set, {&stream, 1});
    table.add({names[order], fixed(stream.seconds(), 2), grouped(histogram.clusters),
               grouped(histogram.far),
               percent(static_cast<double>(histogram.far) / static_cast<double>(points), 4),
               cited(thesis[order])});
    Series series{.name = names[order]};
    for (std::size_t bin = 0; bin < kBins; ++bin) {
      for (const std::size_t edge : {bin, bin + 1}) {
        series.x.push_back(static_cast<double>(edge) / static_cast<double>(kBins));
        series.y.push_back(std::max(0.5, static_cast<double>(histogram.counts[bin])));
      }
    }
    plot.series.push_back(std::move(series));
  }
  for (std::size_t bin = 0; bin < kBins; ++bin) {
    data.add({fixed(static_cast<double>(bin) / static_cast<double>(kBins), 2),
              fixed(static_cast<double>(bin + 1) / static_cast<double>(kBins), 2),
              std::to_string(histograms[0].counts[bin]), std::to_string(histograms[1].counts[bin]),
              std::to_string(histograms[2].counts[bin])});
  }
  setting.report.table(table);
  setting.report.data(data);
  setting.report.plot("figure-7.5", plot);
}

}  // namespace terrace::research
