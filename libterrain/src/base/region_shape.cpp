// SPDX-License-Identifier: Apache-2.0
#include "base/region_shape.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <utility>

#include <fmt/core.h>
#include <geos_c.h>

#include "terrace/stream/error.hpp"

namespace terrace::terrain {
namespace {

/// A copy takes 20 MB for 100,000 corners. The grid answers 99 of 100 queries, so a few copies
/// serve many threads.
constexpr unsigned kMaxPrepared = 4;

/// GEOS's functions, with its last error message.
class Geos {
 public:
  struct Destroy {
    GEOSContextHandle_t context;
    void operator()(GEOSGeometry* g) const { GEOSGeom_destroy_r(context, g); }
    void operator()(const GEOSPreparedGeometry* g) const { GEOSPreparedGeom_destroy_r(context, g); }
    void operator()(GEOSSTRtree* tree) const { GEOSSTRtree_destroy_r(context, tree); }
    void operator()(char* text) const { GEOSFree_r(context, text); }
  };
  template <class T>
  using Owned = std::unique_ptr<T, Destroy>;
  using Geometry = Owned<GEOSGeometry>;

  Geos() : context_(GEOS_init_r()) {
    if (context_ == nullptr) throw fault();
    GEOSContext_setErrorMessageHandler_r(
        context_, [](const char* message, void* to) { *static_cast<std::string*>(to) = message; },
        &message_);
  }
  Geos(const Geos&) = delete;
  Geos& operator=(const Geos&) = delete;
  ~Geos() { GEOS_finish_r(context_); }

  [[nodiscard]] GEOSContextHandle_t context() const { return context_; }
  template <class T>
  [[nodiscard]] Owned<T> adopt(T* object) const {
    if (object == nullptr) throw fault();
    return Owned<T>(object, Destroy{context_});
  }
  /// Converts the answer of a predicate.
  [[nodiscard]] bool is_true(char answer) const {
    if (answer != 0 && answer != 1) throw fault();
    return answer == 1;
  }

  [[nodiscard]] Geometry point(const Point2& p) const {
    return adopt(GEOSGeom_createPointFromXY_r(context_, p[0], p[1]));
  }
  /// Adds the closing corner, which `corners` does not have.
  [[nodiscard]] Geometry ring(std::span<const Point2> corners) const {
    std::vector<Point2> closed(corners.begin(), corners.end());
    closed.push_back(corners.front());
    GEOSCoordSequence* places = GEOSCoordSeq_copyFromBuffer_r(
        context_, closed.front().data(), static_cast<unsigned>(closed.size()), 0, 0);
    if (places == nullptr) throw fault();
    return adopt(
        GEOSGeom_createLinearRing_r(context_, places));  // takes ownership even if it fails
  }
  [[nodiscard]] Geometry polygon(std::span<const Point2> corners) const {
    return adopt(GEOSGeom_createPolygon_r(context_, ring(corners).release(), nullptr, 0));
  }
  [[nodiscard]] Geometry polygon(const Polygon& rings) const {
    std::vector<Geometry> holes;
    for (std::size_t i = 1; i < rings.size(); ++i) holes.push_back(ring(rings[i]));
    Geometry outer = ring(rings.front());
    std::vector<GEOSGeometry*> geometries;
    for (Geometry& hole : holes) geometries.push_back(hole.release());
    return adopt(GEOSGeom_createPolygon_r(context_, outer.release(), geometries.data(),
                                          static_cast<unsigned>(geometries.size())));
  }

 private:
  [[nodiscard]] stream::Error fault() const {
    return stream::Error("", "GEOS failed: " + (message_.empty() ? "out of memory" : message_))
        .at("region")
        .remedy("simplify the polygons, or give a box");
  }

  GEOSContextHandle_t context_;
  std::string message_;
};

void require_valid(const std::vector<Polygon>& polygons, const std::string& file,
                   const std::stop_token& stop) {
  std::string where;
  const auto refused = [&](std::string cause) {
    return stream::Error(file, std::move(cause))
        .at(where)
        .remedy(
            "repair the polygons, for example by \"Fix geometries\" of QGIS "
            "or ST_MakeValid of PostGIS");
  };
  if (polygons.empty()) throw refused("the region contains no polygon");
  for (std::size_t i = 0; i < polygons.size(); ++i) {
    const std::string polygon = fmt::format("polygon {}", i + 1);
    where = polygon;
    if (polygons[i].empty()) throw refused("a polygon has no ring");
    const auto at_ring = [&](std::size_t ring) {
      where = ring == 0 ? polygon + ", outer ring" : fmt::format("{}, hole {}", polygon, ring);
    };
    for (std::size_t ring = 0; ring < polygons[i].size(); ++ring) {
      at_ring(ring);
      if (polygons[i][ring].size() < 3) throw refused("a ring has fewer than three corners");
      for (const Point2& p : polygons[i][ring]) {
        if (!std::isfinite(p[0]) || !std::isfinite(p[1])) {
          throw refused("a coordinate is not finite");
        }
      }
    }
    const std::optional<std::string> fault = fault_of(polygons[i], stop);
    if (!fault) continue;
    for (std::size_t ring = 0; ring < polygons[i].size(); ++ring) {
      at_ring(ring);
      const auto cause = fault_of({polygons[i][ring]}, stop);
      if (cause) throw refused("the ring is not valid: " + *cause);
    }
    where = polygon;
    throw refused("its rings do not form a valid polygon: " + *fault);
  }
}

}  // namespace

/// Polygons prepared by GEOS for fast queries. GEOS builds its indexes while it answers, so only
/// one thread at a time may query.
class RegionShape::Prepared {
 public:
  /// swapped: exchanges x and y.
  Prepared(const std::vector<Polygon>& polygons, bool swapped)
      : swapped_(swapped), tree_(geos_.adopt(GEOSSTRtree_create_r(geos_.context(), 10))) {
    for (const Polygon& polygon : polygons) {
      Polygon turned;
      if (swapped) {
        for (const std::vector<Point2>& ring : polygon) turned.push_back(turn(ring));
      }
      shapes_.push_back(geos_.polygon(swapped ? turned : polygon));
      prepared_.push_back(geos_.adopt(GEOSPrepare_r(geos_.context(), shapes_.back().get())));
    }
    for (std::size_t i = 0; i < shapes_.size(); ++i) {
      GEOSSTRtree_insert_r(geos_.context(), tree_.get(), shapes_[i].get(), &prepared_[i]);
    }
  }

  [[nodiscard]] Geos::Geometry point(const Point2& p) const {
    return geos_.point(swapped_ ? Point2{p[1], p[0]} : p);
  }
  [[nodiscard]] Geos::Geometry polygon(std::span<const Point2> corners) const {
    return geos_.polygon(swapped_ ? std::span<const Point2>(turn(corners)) : corners);
  }
  [[nodiscard]] bool any_meets(const Geos::Geometry& other) const {
    return any(other, GEOSPreparedIntersects_r);
  }
  /// Whether a polygon contains `other` without touching it with a ring. (`covers` compares all
  /// edges where a ring is touched.)
  [[nodiscard]] bool any_holds(const Geos::Geometry& other) const {
    return any(other, GEOSPreparedContainsProperly_r);
  }

 private:
  static std::vector<Point2> turn(std::span<const Point2> corners) {
    std::vector<Point2> turned(corners.begin(), corners.end());
    for (Point2& p : turned) std::swap(p[0], p[1]);
    return turned;
  }

  using Shapes = Geos::Owned<const GEOSPreparedGeometry>;
  using Predicate = char (*)(GEOSContextHandle_t, const GEOSPreparedGeometry*, const GEOSGeometry*);

  [[nodiscard]] bool any(const Geos::Geometry& other, Predicate predicate) const {
    struct Question {
      GEOSContextHandle_t context;
      const GEOSGeometry* other;
      Predicate predicate;
      char answer;
    } question{geos_.context(), other.get(), predicate, 0};
    GEOSSTRtree_query_r(
        question.context, tree_.get(), question.other,
        [](void* item, void* data) {
          auto& query = *static_cast<Question*>(data);
          if (query.answer != 0) return;
          query.answer =
              query.predicate(query.context, static_cast<Shapes*>(item)->get(), query.other);
        },
        &question);
    return geos_.is_true(question.answer);
  }

  bool swapped_;
  Geos geos_;
  Geos::Owned<GEOSSTRtree> tree_;
  std::vector<Geos::Geometry> shapes_;
  std::vector<Shapes> prepared_;
};

namespace {

/// Whether edges are longer in y than in x in total. GEOS visits all edges that cross the row of a
/// place.
bool crosses_rows(const std::vector<Polygon>& polygons) {
  stream::Box3 box;
  for (const Polygon& polygon : polygons) {
    if (polygon.empty()) continue;
    for (const Point2& p : polygon.front()) box.include(stream::Point3{p[0], p[1], 0});
  }
  const Point2 extent = edge_extent(polygons, {box.min[0], box.min[1]}, {box.max[0], box.max[1]});
  return extent[1] > extent[0];
}

const std::vector<Polygon>& found_valid(const std::vector<Polygon>& polygons,
                                        const std::string& file, const std::stop_token& stop) {
  require_valid(polygons, file, stop);
  return polygons;
}

}  // namespace

RegionShape::RegionShape(std::vector<Polygon> polygons, const std::string& file,
                         const std::stop_token& stop)
    : polygons_(std::move(polygons)),
      swapped_(crosses_rows(polygons_)),
      grid_(found_valid(polygons_, file, stop), [&](const Point2& place) {
        if (stop.stop_requested()) throw stream::Stopped();
        return ask([&](const Prepared& shape) { return shape.any_meets(shape.point(place)); });
      }) {}

RegionShape::~RegionShape() = default;

/// Queries a copy that no other thread uses; waits if all are in use.
template <class Ask>
bool RegionShape::ask(const Ask& question) const {
  std::unique_ptr<Prepared> shape;
  {
    std::unique_lock lock(mutex_);
    idle_changed_.wait(lock, [this] { return !idle_.empty() || count_ < kMaxPrepared; });
    if (idle_.empty()) {
      ++count_;
    } else {
      shape = std::move(idle_.back());
      idle_.pop_back();
    }
  }
  const auto put_back = [&] {
    {
      const std::lock_guard lock(mutex_);
      if (shape == nullptr) {
        --count_;
      } else {
        idle_.push_back(std::move(shape));
      }
    }
    idle_changed_.notify_one();
  };
  bool answer = false;
  try {
    if (shape == nullptr) shape = std::make_unique<Prepared>(polygons_, swapped_);
    answer = question(*shape);
  } catch (...) {
    put_back();
    throw;
  }
  put_back();
  return answer;
}

bool RegionShape::covers(const Point2& place) const {
  const Overlap known = grid_.overlap(place);
  if (known != Overlap::part) return known == Overlap::whole;
  return ask([&](const Prepared& shape) { return shape.any_meets(shape.point(place)); });
}

Overlap RegionShape::overlap(const Point2& low, const Point2& high) const {
  const Overlap known = grid_.overlap(low, high);
  if (known != Overlap::part) return known;
  bool whole = false;
  const bool meets = ask([&](const Prepared& shape) {
    const std::array<Point2, 4> corners{low, {high[0], low[1]}, high, {low[0], high[1]}};
    const Geos::Geometry box = shape.polygon(std::span(corners));
    whole = shape.any_holds(box);
    return whole || shape.any_meets(box);
  });
  return whole ? Overlap::whole : meets ? Overlap::part : Overlap::none;
}

bool RegionShape::touches(const std::array<Point2, 3>& triangle) const {
  const auto x = std::minmax({triangle[0][0], triangle[1][0], triangle[2][0]});
  const auto y = std::minmax({triangle[0][1], triangle[1][1], triangle[2][1]});
  const Overlap known = grid_.overlap({x.first, y.first}, {x.second, y.second});
  if (known != Overlap::part) return known == Overlap::whole;
  return ask(
      [&](const Prepared& shape) { return shape.any_meets(shape.polygon(std::span(triangle))); });
}

namespace {

/// Appends the polygons of a geometry; leaves out lines and points, which have no area.
void add_parts(const Geos& geos, const GEOSGeometry* shape, std::vector<Polygon>& polygons) {
  const GEOSContextHandle_t context = geos.context();
  const int type = GEOSGeomTypeId_r(context, shape);
  if (type == GEOS_MULTIPOLYGON || type == GEOS_GEOMETRYCOLLECTION) {
    for (int i = 0; i < GEOSGetNumGeometries_r(context, shape); ++i) {
      add_parts(geos, GEOSGetGeometryN_r(context, shape, i), polygons);
    }
  }
  if (type != GEOS_POLYGON || GEOSisEmpty_r(context, shape) != 0) return;
  const auto corners_of = [&](const GEOSGeometry* ring) {
    std::vector<Point2> corners(static_cast<std::size_t>(GEOSGetNumCoordinates_r(context, ring)));
    GEOSCoordSeq_copyToBuffer_r(context, GEOSGeom_getCoordSeq_r(context, ring),
                                corners.front().data(), 0, 0);
    corners.pop_back();
    return corners;
  };
  Polygon polygon{corners_of(GEOSGetExteriorRing_r(context, shape))};
  for (int hole = 0; hole < GEOSGetNumInteriorRings_r(context, shape); ++hole) {
    polygon.push_back(corners_of(GEOSGetInteriorRingN_r(context, shape, hole)));
  }
  polygons.push_back(std::move(polygon));
}

}  // namespace

std::vector<Polygon> valid_polygons(const Polygon& polygon) {
  if (!fault_of(polygon)) return {polygon};
  const Geos geos;
  const Geos::Geometry input = geos.polygon(polygon);
  std::vector<Polygon> result;
  add_parts(geos, geos.adopt(GEOSMakeValid_r(geos.context(), input.get())).get(), result);
  return result;
}

}  // namespace terrace::terrain
