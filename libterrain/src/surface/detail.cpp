// SPDX-License-Identifier: Apache-2.0
#include "terrace/terrain/detail.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>

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

bool Detail::reaches_into(const Region& there, const stream::Box3& world_box) const {
  if (!there.box().intersects(world_box)) return false;
  stream::Box3 wide = world_box;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    wide.min[axis] -= margin;
    wide.max[axis] += margin;
  }
  return there.overlap(wide) != Overlap::none;
}

namespace {

/// Walks down the levels and collects the clusters that the points on the way head. Unlike
/// stream::StoreQuery it reads whole records, and wanted levels in file order.
class Descent {
 public:
  using Visit = std::function<void(stream::ClusterId, const stream::ClusterRecord&,
                                   const stream::ClusterPoints&)>;

  Descent(const stream::Store& store, const Detail& detail, const Visit& visit)
      : store_(store),
        detail_(detail),
        visit_(visit),
        placement_(store.schema()),
        finest_(detail.finest()),
        first_(detail.cluster.value_or(store.root())),
        heads_(store.top()) {
    const unsigned level = stream::level_of(first_);
    if (level > store.top() || stream::ordinal_of(first_) >= store.levels()[level].clusters) {
      throw UsageError("the store has no cluster " + std::to_string(level) + ":" +
                       std::to_string(stream::ordinal_of(first_)));
    }
    if (level < finest_) {
      throw UsageError("`cluster`: a cluster of level " + std::to_string(level) +
                       " has no points of level " + std::to_string(finest_));
    }
  }

  /// Where the descent begins: the root or the one cluster that is wanted.
  [[nodiscard]] stream::ClusterId first() const { return first_; }

  /// The first and the wanted clusters down to `lowest`; of level 0 those of which points may meet
  /// the condition of a view.
  void run(unsigned lowest) {
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
    deliver(first_, store_.record(first_), points);
    for (unsigned level = stream::level_of(first_); level-- > lowest;) {
      if (whole(level)) {
        store_.for_each(level, [this](stream::ClusterId id, const stream::ClusterRecord& record,
                                      const stream::ClusterPoints& p) { deliver(id, record, p); });
        continue;
      }
      for_each_head(level, [&](stream::ClusterId id, const stream::ClusterRecord& record) {
        // Those above are read in any case, for the clusters that they head.
        if (level == 0 && !store_.may_match(id)) return;
        store_.read(id, points);
        deliver(id, record, points);
      });
    }
  }

  /// A level that is wanted everywhere needs no list of its clusters.
  [[nodiscard]] bool whole(unsigned level) const {
    return level >= detail_.level && !detail_.region && !detail_.cluster;
  }

  /// The wanted clusters among those that points met so far head on `level`, in order.
  template <class Found>
  void for_each_head(unsigned level, const Found& found) {
    std::vector<std::uint64_t> ordinals = std::exchange(heads_[level], {});
    std::sort(ordinals.begin(), ordinals.end());
    for (const std::uint64_t ordinal : ordinals) {
      const stream::ClusterId id = stream::cluster_id(level, ordinal);
      // Most are far away, and so are their pages of the index.
      if (!detail_.wants(level, world_box(placement_, store_.coarse_box(id)))) continue;
      if (!detail_.wants(level, world_box(placement_, store_.page_box(id)))) continue;
      const stream::ClusterRecord record = store_.record(id);
      if (detail_.wants(level, world_box(placement_, record.summary.box))) found(id, record);
    }
  }

 private:
  void deliver(stream::ClusterId id, const stream::ClusterRecord& record,
               const stream::ClusterPoints& points) {
    visit_(id, record, points);
    const unsigned level = stream::level_of(id);
    const stream::Box3 box = world_box(placement_, record.summary.box);
    for (unsigned below = finest_; below < level; ++below) {
      // What lies below this cluster lies in its box.
      if (whole(below) || !detail_.wants(below, box)) continue;
      for (std::size_t i = 0; i < points.size(); ++i) {
        heads_[below].push_back(points.children[i * level + below]);
      }
    }
  }

  const stream::Store& store_;
  const Detail& detail_;
  const Visit& visit_;
  stream::Placement placement_;
  unsigned finest_;
  stream::ClusterId first_;
  std::vector<std::vector<std::uint64_t>> heads_;  // per level, ordinals met in higher levels
};

}  // namespace

void for_each_wanted(const stream::Store& store, const Detail& detail,
                     const std::function<void(stream::ClusterId, const stream::ClusterRecord&,
                                              const stream::ClusterPoints&)>& visit) {
  Descent(store, detail, visit).run(detail.finest());
}

void for_each_wanted_point(const stream::Store& store, const Detail& detail,
                           const std::function<void(stream::ClusterId, const stream::ClusterPoints&,
                                                    std::size_t, const stream::Point3&)>& visit) {
  const stream::Placement& placement = store.schema();
  const auto inside = [&](const stream::Point3& place) {
    return detail.region->contains(place) ||
           std::any_of(detail.focuses.begin(), detail.focuses.end(),
                       [&](const FinerRegion& focus) { return focus.region.contains(place); });
  };
  const auto visit_cluster = [&](stream::ClusterId id, const stream::ClusterRecord& record,
                                 const stream::ClusterPoints& points) {
    const bool whole = !detail.region || detail.region->overlap(world_box(
                                             placement, record.summary.box)) == Overlap::whole;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!points.match(i)) continue;
      const stream::Point3 place = world_point(placement, points.positions[i]);
      if (whole || inside(place)) visit(id, points, i, place);
    }
  };
  for_each_wanted(store, detail, visit_cluster);
}

void for_each_wanted_record(
    const stream::Store& store, const Detail& detail,
    const std::function<void(stream::ClusterId, const stream::ClusterRecord&)>& visit) {
  const Descent::Visit all = [&visit](stream::ClusterId id, const stream::ClusterRecord& record,
                                      const stream::ClusterPoints&) { visit(id, record); };
  Descent descent(store, detail, all);
  const unsigned finest = detail.finest();
  if (finest == stream::level_of(descent.first())) return descent.run(finest);
  // The finest level's clusters need not be read to be counted.
  descent.run(finest + 1);
  if (descent.whole(finest)) {
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
