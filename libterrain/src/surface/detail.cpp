// SPDX-License-Identifier: Apache-2.0
#include "terrace/terrain/detail.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <fmt/core.h>
#include <terrace/base/ordered_work.hpp>

#include "base/store_checks.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::terrain {

unsigned Detail::finest() const {
  unsigned finest = level;
  for (const FinerRegion& focus : focuses) finest = std::min(finest, focus.level);
  return finest;
}

bool Detail::wants(unsigned cluster_level, const stream::Box3& world_box) const {
  if (cluster_level >= level && (!region || reaches_into(*region, world_box))) return true;
  return std::any_of(focuses.begin(), focuses.end(), [&](const FinerRegion& focus) {
    return cluster_level >= focus.level && reaches_into(focus.region, world_box);
  });
}

bool Detail::reaches_into(const Region& target, const stream::Box3& world_box) const {
  if (!target.box().intersects(world_box)) return false;
  stream::Box3 wide = world_box;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    wide.min[axis] -= margin;
    wide.max[axis] += margin;
  }
  return target.overlap(wide) != Overlap::none;
}

Detail with_margin(const stream::Store& store, Detail detail) {
  const stream::Box3 all = world_box(store.schema(), store.whole().bounds());
  const auto clusters =
      static_cast<double>(store.levels()[std::min(detail.finest(), store.top())].clusters);
  detail.margin = 2 * std::sqrt((all.max[0] - all.min[0]) * (all.max[1] - all.min[1]) / clusters);
  return detail;
}

void note_idle_focuses(const stream::Store& store, const Detail& detail, const Context& context) {
  if (store.whole().points() == 0) return;
  const stream::Box3 all = world_box(store.schema(), store.whole().bounds());
  for (std::size_t i = 0; i < detail.focuses.size(); ++i) {
    if (detail.reaches_into(detail.focuses[i].region, all)) continue;
    const std::string ordinal = detail.focuses.size() > 1 ? fmt::format(" {}", i + 1) : "";
    context.say(stream::message("{focus}{} is outside the store and adds no points: they have {}",
                                ordinal, extent_text(store.whole())));
  }
}

namespace {

/// Number of points that are processed at once.
constexpr std::uint64_t kPointsAtOnce = 16384;
/// Number of clusters whose records are requested together from a server.
constexpr std::size_t kRecordsAtOnce = 65536;

/// Descends the levels and collects the clusters headed by the points it meets. Unlike
/// stream::StoreQuery it reads whole records, and wanted levels in file order.
class Descent {
 public:
  using MakePart = std::function<std::unique_ptr<WantedPart>(unsigned)>;

  Descent(const stream::Store& store, const Detail& detail, const MakePart& make, unsigned threads)
      : store_(store),
        detail_(detail),
        make_(make),
        threads_(threads),
        placement_(store.schema()),
        finest_(detail.finest()),
        first_(detail.cluster.value_or(store.root())),
        heads_(store.top()) {
    const unsigned level = stream::level_of(first_);
    if (level > store.top() || stream::ordinal_of(first_) >= store.levels()[level].clusters) {
      throw UsageError(
          fmt::format("the store has no cluster {}:{}", level, stream::ordinal_of(first_)));
    }
    if (level < finest_) {
      throw UsageError(stream::message("{cluster}: a cluster of level {} has no points of level {}",
                                       level, finest_));
    }
  }

  /// The start of the descent: the root, or the one wanted cluster.
  [[nodiscard]] stream::ClusterId first() const { return first_; }

  /// Visits the first cluster and the wanted clusters down to level `lowest`. At level 0, visits
  /// only clusters with points that may meet the condition of a view.
  void run(unsigned lowest) {
    take(read_first());
    for (unsigned level = stream::level_of(first_); level-- > lowest;) {
      if (is_complete(level)) {
        run_all(level);
      } else {
        run_heads(level);
      }
    }
  }

  /// Whether a level is wanted everywhere, so that no list of its clusters is needed.
  [[nodiscard]] bool is_complete(unsigned level) const {
    return level >= detail_.level && !detail_.region && !detail_.cluster;
  }

  /// Visits the wanted clusters of `level` headed by points met so far, in order.
  template <class Found>
  void for_each_head(unsigned level, const Found& found) {
    for (const std::uint64_t ordinal : take_heads(level)) {
      const stream::ClusterId id = stream::cluster_id(level, ordinal);
      if (const auto record = wanted(id)) found(id, *record);
    }
  }

 private:
  /// The result of reading some clusters.
  struct Read {
    std::unique_ptr<WantedPart> part;
    std::vector<std::vector<std::uint64_t>> heads;  // as in Descent
    std::uint64_t members = 0;
  };

  [[nodiscard]] Read begin(unsigned worker) const {
    return {.part = make_(worker), .heads = std::vector<std::vector<std::uint64_t>>(heads_.size())};
  }

  void add(Read& to, stream::ClusterId id, const stream::ClusterRecord& record,
           const stream::ClusterPoints& points) const {
    to.part->add(id, record, points);
    const unsigned level = stream::level_of(id);
    const stream::Box3 box = world_box(placement_, record.summary.box);
    for (unsigned below = finest_; below < level; ++below) {
      // Everything below this cluster is inside its box.
      if (is_complete(below) || !detail_.wants(below, box)) continue;
      for (std::size_t i = 0; i < points.size(); ++i) {
        to.heads[below].push_back(points.children[i * level + below]);
      }
    }
  }

  void take(Read read) {
    for (std::size_t level = 0; level < heads_.size(); ++level) {
      heads_[level].insert(heads_[level].end(), read.heads[level].begin(), read.heads[level].end());
    }
    read.part->take();
  }

  [[nodiscard]] Read read_first() const {
    stream::ClusterPoints points;
    store_.read(first_, points);
    if (detail_.cluster && points.has_representative) {
      points.positions.push_back(points.representative);
      points.payload.insert(points.payload.end(), points.representative_payload.begin(),
                            points.representative_payload.end());
      points.children.insert(points.children.end(), points.representative_children.begin(),
                             points.representative_children.end());
      if (const stream::Where* condition = store_.condition()) {
        points.matches.push_back(0);
        condition->test({&points.representative, 1}, points.representative_payload,
                        std::span(points.matches).last(1));
      }
    }
    Read read = begin(0);
    add(read, first_, store_.record(first_), points);
    read.part->end();
    return read;
  }

  void run_all(unsigned level) {
    const std::uint64_t clusters = store_.levels()[level].clusters;
    const std::uint64_t members = store_.levels()[level].members;
    const std::uint64_t each = clusters_per_part(level);
    std::uint64_t read_so_far = 0;
    base::in_order(
        static_cast<std::size_t>((clusters + each - 1) / each), threads_,
        [&](unsigned worker, std::size_t i) {
          Read read = begin(worker);
          const auto visit = [&](stream::ClusterId id, const stream::ClusterRecord& record,
                                 const stream::ClusterPoints& points) {
            add(read, id, record, points);
          };
          read.members =
              store_.for_each(level, i * each, std::min(clusters, (i + 1) * each), visit);
          read.part->end();
          return read;
        },
        [&](std::size_t, Read&& read) {
          read_so_far += read.members;
          if (read_so_far > members) throw store_.miscounted(level);
          take(std::move(read));
        });
    if (read_so_far != members) throw store_.miscounted(level);
  }

  void run_heads(unsigned level) {
    const std::vector<std::uint64_t> all = take_heads(level);
    for (std::span<const std::uint64_t> rest = all; !rest.empty();) {
      const std::size_t count = store_.is_remote() ? prefetch(level, rest) : rest.size();
      run_heads(level, rest.first(count));
      rest = rest.subspan(count);
    }
  }

  /// Requests from a server what the first of these clusters need. Returns their number.
  [[nodiscard]] std::size_t prefetch(unsigned level, std::span<const std::uint64_t> ordinals) {
    const std::size_t count =
        store_.prefetch(stream::Store::Part::page_box, level,
                        ordinals.first(std::min(kRecordsAtOnce, ordinals.size())));
    ordinals =
        ordinals.first(store_.prefetch(stream::Store::Part::record, level, ordinals.first(count)));
    std::vector<std::uint64_t> chosen;
    std::vector<std::size_t> places;
    for (std::size_t i = 0; i < ordinals.size(); ++i) {
      if (!wanted(stream::cluster_id(level, ordinals[i]))) continue;
      chosen.push_back(ordinals[i]);
      places.push_back(i);
    }
    const std::size_t taken = store_.prefetch(stream::Store::Part::cluster, level, chosen);
    return taken < chosen.size() ? places[taken] : ordinals.size();
  }

  void run_heads(unsigned level, std::span<const std::uint64_t> ordinals) {
    const std::size_t each = static_cast<std::size_t>(clusters_per_part(level));
    base::in_order((ordinals.size() + each - 1) / each, threads_,
                   [&](unsigned worker, std::size_t i) {
                     Read read = begin(worker);
                     stream::ClusterPoints points;
                     for (std::size_t k = i * each; k < std::min(ordinals.size(), (i + 1) * each);
                          ++k) {
                       const stream::ClusterId id = stream::cluster_id(level, ordinals[k]);
                       const auto record = wanted(id);
                       // Higher levels are always read, for the clusters that their points head.
                       if (!record || (level == 0 && !store_.may_match(id))) continue;
                       store_.read(id, points);
                       add(read, id, *record, points);
                     }
                     read.part->end();
                     return read;
                   },
                   [&](std::size_t, Read&& read) { take(std::move(read)); });
  }

  [[nodiscard]] std::uint64_t clusters_per_part(unsigned level) const {
    const stream::LevelInfo& info = store_.levels()[level];
    return std::max<std::uint64_t>(
        1, kPointsAtOnce * info.clusters / std::max<std::uint64_t>(1, info.members));
  }

  [[nodiscard]] std::vector<std::uint64_t> take_heads(unsigned level) {
    std::vector<std::uint64_t> ordinals = std::exchange(heads_[level], {});
    std::sort(ordinals.begin(), ordinals.end());
    return ordinals;
  }

  [[nodiscard]] std::optional<stream::ClusterRecord> wanted(stream::ClusterId id) const {
    const unsigned level = stream::level_of(id);
    // Most clusters are far away, and so are their index pages, so test coarser boxes first.
    if (!detail_.wants(level, world_box(placement_, store_.coarse_box(id)))) return {};
    if (!detail_.wants(level, world_box(placement_, store_.page_box(id)))) return {};
    const stream::ClusterRecord record = store_.record(id);
    if (!detail_.wants(level, world_box(placement_, record.summary.box))) return {};
    return record;
  }

  const stream::Store& store_;
  const Detail& detail_;
  const MakePart& make_;
  unsigned threads_;
  stream::Placement placement_;
  unsigned finest_;
  stream::ClusterId first_;
  std::vector<std::vector<std::uint64_t>> heads_;  // per level, ordinals met in higher levels
};

/// Passes clusters on as they are read.
class Shown final : public WantedPart {
 public:
  explicit Shown(const stream::Store::VisitCluster& visit) : visit_(visit) {}
  void add(stream::ClusterId id, const stream::ClusterRecord& record,
           const stream::ClusterPoints& points) override {
    visit_(id, record, points);
  }
  void take() override {}

 private:
  const stream::Store::VisitCluster& visit_;
};

/// Collects the places of points.
class Places final : public WantedPart {
 public:
  using Show = std::function<void(std::span<const stream::Point3>)>;

  Places(const WantedPoints& wanted, const Show& show) : wanted_(wanted), show_(show) {}
  void add(stream::ClusterId, const stream::ClusterRecord& record,
           const stream::ClusterPoints& points) override {
    wanted_(record, points,
            [&](std::size_t, const stream::Point3& place) { places_.push_back(place); });
  }
  void take() override { show_(places_); }

 private:
  const WantedPoints& wanted_;
  const Show& show_;
  std::vector<stream::Point3> places_;
};

}  // namespace

void for_each_wanted(const stream::Store& store, const Detail& detail, unsigned threads,
                     const std::function<std::unique_ptr<WantedPart>(unsigned)>& make) {
  Descent(store, detail, make, threads).run(detail.finest());
}

void for_each_wanted(const stream::Store& store, const Detail& detail,
                     const stream::Store::VisitCluster& visit) {
  for_each_wanted(store, detail, 1, [&](unsigned) { return std::make_unique<Shown>(visit); });
}

WantedPoints::WantedPoints(const stream::Store& store, const Detail& detail)
    : detail_(detail), placement_(store.schema()) {}

void WantedPoints::operator()(
    const stream::ClusterRecord& record, const stream::ClusterPoints& points,
    const std::function<void(std::size_t, const stream::Point3&)>& visit) const {
  const auto inside = [&](const stream::Point3& place) {
    return detail_.region->contains(place) ||
           std::any_of(detail_.focuses.begin(), detail_.focuses.end(),
                       [&](const FinerRegion& focus) { return focus.region.contains(place); });
  };
  const bool is_inside = !detail_.region || detail_.region->overlap(world_box(
                                                placement_, record.summary.box)) == Overlap::whole;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!points.match(i)) continue;
    const stream::Point3 place = world_point(placement_, points.positions[i]);
    if (is_inside || inside(place)) visit(i, place);
  }
}

void for_each_wanted_place(const stream::Store& store, const Detail& detail, unsigned threads,
                           const std::function<void(std::span<const stream::Point3>)>& show) {
  const WantedPoints wanted(store, detail);
  for_each_wanted(store, detail, threads,
                  [&](unsigned) { return std::make_unique<Places>(wanted, show); });
}

void for_each_wanted_point(const stream::Store& store, const Detail& detail,
                           const std::function<void(stream::ClusterId, const stream::ClusterPoints&,
                                                    std::size_t, const stream::Point3&)>& visit) {
  const WantedPoints wanted(store, detail);
  for_each_wanted(store, detail,
                  [&](stream::ClusterId id, const stream::ClusterRecord& record,
                      const stream::ClusterPoints& points) {
                    wanted(record, points, [&](std::size_t i, const stream::Point3& place) {
                      visit(id, points, i, place);
                    });
                  });
}

void for_each_wanted_record(
    const stream::Store& store, const Detail& detail,
    const std::function<void(stream::ClusterId, const stream::ClusterRecord&)>& visit) {
  const stream::Store::VisitCluster all =
      [&visit](stream::ClusterId id, const stream::ClusterRecord& record,
               const stream::ClusterPoints&) { visit(id, record); };
  const Descent::MakePart make = [&](unsigned) { return std::make_unique<Shown>(all); };
  Descent descent(store, detail, make, 1);
  const unsigned finest = detail.finest();
  if (finest == stream::level_of(descent.first())) return descent.run(finest);
  // Counting does not require reading the clusters of the finest level.
  descent.run(finest + 1);
  if (descent.is_complete(finest)) {
    for (std::uint64_t c = 0; c < store.levels()[finest].clusters; ++c) {
      const stream::ClusterId id = stream::cluster_id(finest, c);
      visit(id, store.record(id));
    }
  } else {
    descent.for_each_head(finest, visit);
  }
}

std::uint64_t wanted_points(const stream::Store& store, const Detail& detail) {
  std::uint64_t points = 0;
  if (store.condition() != nullptr) {
    for_each_wanted(
        store, detail,
        [&](stream::ClusterId, const stream::ClusterRecord&, const stream::ClusterPoints& of) {
          points += static_cast<std::uint64_t>(std::count(of.matches.begin(), of.matches.end(), 1));
        });
  } else if (!detail.region && detail.focuses.empty() && !detail.cluster) {
    points = store.levels()[detail.level].points;
  } else {
    for_each_wanted_record(
        store, detail,
        [&](stream::ClusterId, const stream::ClusterRecord& record) { points += record.points; });
  }
  return points;
}

}  // namespace terrace::terrain
