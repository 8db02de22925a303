// SPDX-License-Identifier: Apache-2.0
#include "earth/crs/proj_reader.hpp"

#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <terrace/base/portable_math.hpp>

#include "earth/crs/projection_engine.hpp"
#include "earth/crs/projection_names.hpp"

namespace terrace::terrain {
namespace {

struct Axis {
  std::string direction;
  double unit = 1;  ///< the unit in radians or metres
};

std::vector<Axis> axes_of(const PJ* crs) {
  PJ_CONTEXT* const context = proj_context();
  const ProjObject system(proj_crs_get_coordinate_system(context, crs));
  std::vector<Axis> axes;
  const int count = system != nullptr ? proj_cs_get_axis_count(context, system.get()) : 0;
  for (int i = 0; i < count; ++i) {
    const char* direction = nullptr;
    Axis axis;
    proj_cs_get_axis_info(context, system.get(), i, nullptr, nullptr, &direction, &axis.unit,
                          nullptr, nullptr, nullptr);
    axis.direction = text_of(direction);
    if (!(axis.unit > 0) || !std::isfinite(axis.unit)) {
      throw CrsError("the CRS \"" + text_of(proj_get_name(crs)) + "\" has a unit without a size",
                     remedy_by_code());
    }
    axes.push_back(axis);
  }
  return axes;
}

void read_code(const PJ* crs, CrsDefinition& definition) {
  definition.authority = text_of(proj_get_id_auth_name(crs, 0));
  definition.code = text_of(proj_get_id_code(crs, 0));
}

int epsg_of(const PJ* object) {
  CrsDefinition definition;
  read_code(object, definition);
  return definition.epsg();
}

/// Returns the coded geographic system with the same datum name. Files without codes spell these
/// names in many ways. The caller checks that the ellipsoid matches.
ProjObject identified(const PJ* geographic) {
  PJ_CONTEXT* const context = proj_context();
  int* confidence = nullptr;
  const ProjOwned<PJ_OBJ_LIST> candidates(
      proj_identify(context, geographic, "EPSG", nullptr, &confidence));
  check_proj_database();
  constexpr int kSure = 70;
  ProjObject result;
  if (candidates != nullptr && confidence != nullptr && proj_list_get_count(candidates.get()) > 0 &&
      confidence[0] >= kSure) {
    result.reset(proj_list_get(context, candidates.get(), 0));
  }
  proj_int_list_destroy(confidence);
  return result;
}

void read_ellipsoid(const PJ* crs, CrsDefinition& definition) {
  PJ_CONTEXT* const context = proj_context();
  const ProjObject ellipsoid(proj_get_ellipsoid(context, crs));
  Ellipsoid& parsed = definition.ellipsoid;
  if (ellipsoid == nullptr ||
      proj_ellipsoid_get_parameters(context, ellipsoid.get(), &parsed.semi_major, nullptr, nullptr,
                                    &parsed.inverse_flattening) == 0) {
    throw CrsError("the CRS \"" + definition.name + "\" has no ellipsoid", remedy_by_code());
  }
  const ProjObject meridian(proj_get_prime_meridian(context, crs));
  double longitude = 0, unit = base::kRadiansPerDegree;
  if (meridian != nullptr) {
    proj_prime_meridian_get_parameters(context, meridian.get(), &longitude, &unit, nullptr);
  }
  definition.prime_meridian = longitude == 0 ? 0 : longitude * degrees_of(unit);
  const ProjObject datum(proj_crs_get_datum_forced(context, crs));
  if (datum != nullptr) definition.datum = text_of(proj_get_name(datum.get()));
  if (!(parsed.semi_major > 0 && std::isfinite(parsed.semi_major) && parsed.flattening() >= 0 &&
        parsed.flattening() < 0.5)) {
    throw CrsError("the CRS \"" + definition.name + "\" has an impossible ellipsoid",
                   remedy_by_code());
  }
  if (!std::isfinite(definition.prime_meridian)) {
    throw CrsError("the CRS \"" + definition.name + "\" has no prime meridian", remedy_by_code());
  }
}

/// Returns the CRS without its third axis.
ProjObject demoted_to_2d(const PJ* crs) {
  return ProjObject(proj_crs_demote_to_2D(proj_context(), nullptr, crs));
}

void read_base(const PJ* crs, CrsDefinition& definition) {
  PJ_CONTEXT* const context = proj_context();
  const ProjObject geodetic(proj_crs_get_geodetic_crs(context, crs));
  ProjObject base = geodetic != nullptr ? demoted_to_2d(geodetic.get()) : nullptr;
  if (base == nullptr) {
    throw CrsError("the CRS \"" + definition.name + "\" has no base geographic CRS",
                   remedy_by_code());
  }
  definition.base_epsg = epsg_of(base.get());
  if (definition.base_epsg == 0) {
    if (ProjObject registered = identified(base.get())) {
      CrsDefinition first, second;
      read_ellipsoid(base.get(), first);
      read_ellipsoid(registered.get(), second);
      if (std::abs(first.ellipsoid.semi_major / second.ellipsoid.semi_major - 1) < 1e-9 &&
          std::abs(first.ellipsoid.flattening() - second.ellipsoid.flattening()) < 1e-9 &&
          first.prime_meridian == second.prime_meridian &&
          axes_of(base.get()).front().unit == axes_of(registered.get()).front().unit) {
        base = std::move(registered);
        definition.base_epsg = epsg_of(base.get());
      }
    }
  }
  read_ellipsoid(base.get(), definition);
  definition.base_wkt = wkt_of(base.get());
  definition.degrees_per_unit = degrees_of(axes_of(base.get()).front().unit);
}

void read_projected(const PJ* crs, CrsDefinition& definition) {
  PJ_CONTEXT* const context = proj_context();
  definition.geographic = false;
  const std::vector<Axis> axes = axes_of(crs);
  if (axes.size() < 2) {
    throw CrsError("the CRS \"" + definition.name + "\" has no axes", remedy_by_code());
  }
  definition.metres_per_unit = metres_of(axes[0].unit);
  const ProjObject conversion(proj_crs_get_coordoperation(context, crs));
  if (conversion == nullptr) return;
  const auto projection =
      geographiclib_projection(conversion.get(), axes[0].direction, axes[1].direction);
  if (!projection) return;
  definition.method = projection->method;
  definition.parameters = projection->parameters;
}

/// Reads the shift of TOWGS84 or of a bound CRS.
void read_shift(const PJ* bound, CrsDefinition& definition) {
  PJ_CONTEXT* const context = proj_context();
  const ProjObject transformation(proj_crs_get_coordoperation(context, bound));
  DatumShift shift{};
  if (transformation == nullptr ||
      proj_coordoperation_get_towgs84_values(context, transformation.get(), shift.data(),
                                             static_cast<int>(shift.size()), 1) == 0) {
    throw CrsError("the CRS \"" + definition.name +
                       "\" is bound to another by an operation that is not a shift by seven "
                       "parameters",
                   remedy_by_code());
  }
  for (double& value : shift) {
    if (!std::isfinite(value)) {
      throw CrsError("the CRS \"" + definition.name + "\" has a shift to WGS 84 that is not finite",
                     remedy_by_code());
    }
    // WKT stores the scale as 1 + the difference; rounding restores the digits lost by that.
    if (std::abs(value) < 1e5) value = std::round(value * 1e9) / 1e9;
  }
  definition.shift = shift;
}

/// Returns a local or geocentric system, which it does not read into `definition`.
std::optional<LocalCrs> read_horizontal(const PJ* crs, CrsDefinition& definition) {
  PJ_CONTEXT* const context = proj_context();
  definition.name = text_of(proj_get_name(crs));
  const PJ_TYPE type = proj_get_type(crs);
  if (type == PJ_TYPE_BOUND_CRS) {
    const ProjObject source(proj_get_source_crs(context, crs));
    if (source == nullptr) throw CrsError("the bound CRS has no source", remedy_by_code());
    auto local = read_horizontal(source.get(), definition);
    if (!local) read_shift(crs, definition);
    return local;
  }
  if (type == PJ_TYPE_ENGINEERING_CRS || type == PJ_TYPE_GEOCENTRIC_CRS) {
    LocalCrs local{.crs = {}, .is_geocentric = type == PJ_TYPE_GEOCENTRIC_CRS};
    local.crs.name = definition.name;
    local.crs.wkt = wkt_of(crs);
    const std::vector<Axis> axes = axes_of(crs);
    if (!axes.empty()) local.crs.horizontal_unit = unit_name(axes[0].unit);
    if (local.is_geocentric) {
      local.crs.vertical_unit = local.crs.horizontal_unit;
    } else if (axes.size() == 3) {
      local.crs.vertical_unit = recorded_unit(metres_of(axes[2].unit));
    }
    return local;
  }
  const bool geographic = type == PJ_TYPE_GEOGRAPHIC_2D_CRS || type == PJ_TYPE_GEOGRAPHIC_3D_CRS;
  if (!geographic && type != PJ_TYPE_PROJECTED_CRS) {
    throw CrsError("the CRS \"" + definition.name + "\" is neither geographic nor projected",
                   remedy_by_code());
  }
  if (geographic && proj_crs_is_derived(context, crs) != 0) {
    throw CrsError("the CRS \"" + definition.name +
                       "\" is derived from another geographic one, which is not supported",
                   "convert the data to longitudes and latitudes first");
  }
  const ProjObject plane = demoted_to_2d(crs);
  if (plane == nullptr)
    throw CrsError("the CRS \"" + definition.name + "\" is incomplete", remedy_by_code());
  const std::vector<Axis> axes = axes_of(crs);
  if (axes.size() == 3) {
    definition.heights = Heights::ellipsoidal;
    definition.metres_per_height = metres_of(axes[2].unit);
    definition.height_wkt = wkt_of(crs);
  }
  read_code(crs, definition);
  definition.wkt = wkt_of(plane.get());
  if (definition.wkt.empty()) {
    throw CrsError("the CRS \"" + definition.name + "\" cannot be written as WKT",
                   remedy_by_code());
  }
  read_base(plane.get(), definition);
  if (!geographic) read_projected(plane.get(), definition);
  return std::nullopt;
}

/// Whether both definitions give the same coordinates, to a tenth of a millimetre, for some places
/// in the area of use of the code.
bool same_numbers(const CrsDefinition& a, const CrsDefinition& b, const PJ* code) {
  double west = 0, south = 0, east = 0, north = 0;
  if (proj_get_area_of_use(proj_context(), code, &west, &south, &east, &north, nullptr) == 0) {
    return false;
  }
  if (east < west) east += 360;
  std::array<Point2, 5> one{};
  for (std::size_t i = 0; i < one.size(); ++i) {
    const double t = 0.1 + 0.2 * static_cast<double>(i);
    one[i] = {west + t * (east - west) - a.prime_meridian,
              south + (i % 2 == 0 ? t : 1 - t) * (north - south)};
  }
  std::array<Point2, 5> other = one;
  projection_of(a)->forward(one);
  projection_of(b)->forward(other);
  for (std::size_t i = 0; i < one.size(); ++i) {
    for (std::size_t axis = 0; axis < 2; ++axis) {
      if (!std::isfinite(one[i][axis]) && !std::isfinite(other[i][axis])) continue;
      if (!(std::abs(one[i][axis] - other[i][axis]) < 1e-4)) return false;
    }
  }
  return true;
}

void take(CrsDefinition&& registered, CrsDefinition& definition) {
  registered.shift = definition.shift;
  if (registered.heights == Heights::unknown) {
    registered.heights = definition.heights;
    registered.height_wkt = definition.height_wkt;
    registered.vertical_name = definition.vertical_name;
    registered.vertical_epsg = definition.vertical_epsg;
    registered.metres_per_height = definition.metres_per_height;
  }
  definition = std::move(registered);
}

void check_code(CrsDefinition& definition) {
  const ProjObject code = proj_crs_of_code(definition.authority, definition.code);
  if (code == nullptr) return;
  CrsDefinition registered = read_definition(code.get());
  const auto differs = [](double a, double b) { return !(std::abs(a / b - 1) < 1e-9); };
  std::string what;
  if (registered.geographic != definition.geographic) {
    what = "the kind";
  } else if (differs(registered.ellipsoid.semi_major, definition.ellipsoid.semi_major) ||
             std::abs(registered.ellipsoid.flattening() - definition.ellipsoid.flattening()) >
                 1e-9) {
    what = "the ellipsoid";
  } else if (std::abs(registered.prime_meridian - definition.prime_meridian) > 1e-9) {
    what = "the prime meridian";
  } else if (registered.geographic
                 ? differs(registered.degrees_per_unit, definition.degrees_per_unit)
                 : differs(registered.metres_per_unit, definition.metres_per_unit)) {
    what = "the unit";
  } else if (!registered.geographic && !same_places(registered, definition) &&
             !same_numbers(registered, definition, code.get())) {
    what = "the projection";
  }
  if (!what.empty()) {
    throw ContradictoryCrs("the definition of \"" + definition.name + "\" contradicts its code " +
                               definition.authority + ":" + definition.code + " in " + what,
                           remedy_by_code());
  }
  take(std::move(registered), definition);
}

}  // namespace

void read_vertical_crs(const PJ* crs, CrsDefinition& definition) {
  PJ_CONTEXT* const context = proj_context();
  if (proj_get_type(crs) == PJ_TYPE_BOUND_CRS) {
    const ProjObject source(proj_get_source_crs(context, crs));
    if (source != nullptr) return read_vertical_crs(source.get(), definition);
  }
  const std::string name = text_of(proj_get_name(crs));
  const std::vector<Axis> axes = axes_of(crs);
  if (proj_get_type(crs) != PJ_TYPE_VERTICAL_CRS || axes.empty()) {
    throw CrsError("the CRS \"" + name + "\" is not a CRS of heights", remedy_by_code());
  }
  if (axes[0].direction != "up") {
    throw CrsError(
        "the vertical CRS \"" + name + "\" measures depths downwards",
        stream::message("name a CRS of heights, or say what heights refer to with {vertical}"));
  }
  definition.metres_per_height = metres_of(axes[0].unit);
  if (plain_name(name) == kUnknownHeights) return;
  definition.vertical_epsg = epsg_of(crs);
  definition.vertical_name = name;
  // OGC's type 2002 means heights above the ellipsoid.
  const std::string wkt1 = text_of(proj_as_wkt(context, crs, PJ_WKT1_GDAL, nullptr));
  const bool ellipsoidal = wkt1.find(",2002") != std::string::npos ||
                           plain_name(name).find("ellipsoid") != std::string::npos;
  definition.heights = ellipsoidal ? Heights::ellipsoidal : Heights::orthometric;
  definition.height_wkt = ellipsoidal ? std::string() : wkt_of(crs);
}

AnyCrs read_crs(const PJ* crs) {
  PJ_CONTEXT* const context = proj_context();
  CrsDefinition definition;
  if (proj_get_type(crs) != PJ_TYPE_COMPOUND_CRS) {
    if (proj_get_type(crs) == PJ_TYPE_VERTICAL_CRS) {
      const std::string code = text_of(proj_get_id_code(crs, 0));
      throw CrsError("EPSG:" + code + " is a vertical CRS",
                     "write it after a horizontal one: EPSG:4326+" + code);
    }
    if (auto local = read_horizontal(crs, definition)) return *std::move(local);
    return definition;
  }
  const ProjObject horizontal(proj_crs_get_sub_crs(context, crs, 0)),
      vertical(proj_crs_get_sub_crs(context, crs, 1));
  if (horizontal == nullptr || vertical == nullptr) {
    throw CrsError("the compound CRS \"" + text_of(proj_get_name(crs)) + "\" is incomplete",
                   remedy_by_code());
  }
  if (auto local = read_horizontal(horizontal.get(), definition)) {
    const std::vector<Axis> axes = axes_of(vertical.get());
    if (!local->is_geocentric && axes.size() == 1) {
      local->crs.vertical_unit = recorded_unit(metres_of(axes[0].unit));
    }
    return *std::move(local);
  }
  read_vertical_crs(vertical.get(), definition);
  return definition;
}

void settle_code(CrsDefinition& definition) {
  if (definition.epsg() != 0) return check_code(definition);
  if (!definition.code.empty()) return;
  const ProjObject crs = proj_crs_of_text(definition.wkt);
  int* confidence = nullptr;
  const ProjOwned<PJ_OBJ_LIST> list(
      crs != nullptr ? proj_identify(proj_context(), crs.get(), "EPSG", nullptr, &confidence)
                     : nullptr);
  check_proj_database();
  std::optional<CrsDefinition> only;
  bool several = false;
  constexpr int kSure = 70;
  const int count = list != nullptr ? proj_list_get_count(list.get()) : 0;
  for (int i = 0; i < count && confidence[i] >= kSure; ++i) {
    const ProjObject candidate(proj_list_get(proj_context(), list.get(), i));
    if (proj_is_deprecated(candidate.get()) != 0) continue;
    CrsDefinition registered = read_definition(candidate.get());
    if (registered.heights != Heights::unknown || !same_places(registered, definition)) continue;
    several = several || only.has_value();
    only = std::move(registered);
  }
  proj_int_list_destroy(confidence);
  if (only && !several) take(std::move(*only), definition);
}

}  // namespace terrace::terrain
