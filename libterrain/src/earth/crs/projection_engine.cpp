// SPDX-License-Identifier: Apache-2.0
#include "earth/crs/projection_engine.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <stdexcept>

#include <GeographicLib/Math.hpp>

#include "earth/crs/proj_pipeline.hpp"
#include "earth/crs/projection_names.hpp"

namespace terrace::terrain {
namespace {

/// The definitions of a method that GeographicLib computes.
enum class Condition : std::uint8_t {
  none,
  /// Around a pole, all axes of a coordinate system point in the same direction.
  polar_axes,
  /// At a latitude of origin off the equator the definition is ambiguous about where the scale
  /// applies.
  origin_on_equator,
};

/// A method of the EPSG dataset that GeographicLib computes. PROJ computes all others.
struct EngineRow {
  ProjectionMethod method;
  int code;
  const char* name;
  Condition condition;
};
constexpr std::array<EngineRow, 9> kByGeographicLib{{
    {ProjectionMethod::transverse_mercator, 9807, "Transverse Mercator", Condition::none},
    {ProjectionMethod::lambert_1sp, 9801, "Lambert Conic Conformal (1SP)", Condition::none},
    {ProjectionMethod::lambert_2sp, 9802, "Lambert Conic Conformal (2SP)", Condition::none},
    {ProjectionMethod::albers, 9822, "Albers Equal Area", Condition::none},
    {ProjectionMethod::polar_stereographic_a, 9810, "Polar Stereographic (variant A)",
     Condition::polar_axes},
    {ProjectionMethod::polar_stereographic_b, 9829, "Polar Stereographic (variant B)",
     Condition::polar_axes},
    {ProjectionMethod::web_mercator, 1024, "Popular Visualisation Pseudo Mercator",
     Condition::none},
    {ProjectionMethod::mercator_a, 9804, "Mercator (variant A)", Condition::origin_on_equator},
    {ProjectionMethod::mercator_b, 9805, "Mercator (variant B)", Condition::none},
}};

double ProjectionParameters::*member_of(ParameterRole role) {
  using P = ProjectionParameters;
  switch (role) {
    case ParameterRole::latitude:
      return &P::latitude;
    case ParameterRole::longitude:
      return &P::longitude;
    case ParameterRole::scale:
      return &P::scale;
    case ParameterRole::false_easting:
      return &P::false_easting;
    case ParameterRole::false_northing:
      return &P::false_northing;
    case ParameterRole::parallel1:
      return &P::parallel1;
    case ParameterRole::parallel2:
      return &P::parallel2;
    case ParameterRole::azimuth:
    case ParameterRole::skew:
      break;
  }
  return nullptr;
}

/// A projection computed by PROJ.
class ProjProjection final : public Projection {
 public:
  ProjProjection(const std::string& pipeline, double degrees_per_unit, double metres_per_unit)
      : pipeline_(pipeline), degrees_(degrees_per_unit), metres_(metres_per_unit) {}

  void forward(std::span<Point2> places) const override {
    if (degrees_ != 1) {
      for (Point2& place : places) place = {place[0] / degrees_, place[1] / degrees_};
    }
    pipeline_.forward(places);
    if (metres_ == 1) return;
    for (Point2& place : places) place = {place[0] * metres_, place[1] * metres_};
  }
  void reverse(std::span<Point2> places) const override {
    if (metres_ != 1) {
      for (Point2& place : places) place = {place[0] / metres_, place[1] / metres_};
    }
    pipeline_.reverse(places);
    for (Point2& place : places) {
      place = {GeographicLib::Math::AngNormalize(place[0] * degrees_), place[1] * degrees_};
    }
  }

 private:
  ProjPipeline pipeline_;
  double degrees_, metres_;
};

}  // namespace

std::optional<GeographicLibProjection> geographiclib_projection(const PJ* conversion,
                                                                std::string_view first,
                                                                std::string_view second) {
  const char *name = nullptr, *authority = nullptr, *code = nullptr;
  if (proj_coordoperation_get_method_info(proj_context(), conversion, &name, &authority, &code) ==
      0) {
    return std::nullopt;
  }
  for (const EngineRow& row : kByGeographicLib) {
    if (!is_called(row.code, row.name, authority, code, name)) continue;
    const bool along =
        (first == "east" && second == "north") || (first == "north" && second == "east");
    const bool polar = first == second && (first == "north" || first == "south");
    if (!along && !(polar && row.condition == Condition::polar_axes)) return std::nullopt;
    GeographicLibProjection known{.method = row.method, .parameters = {}};
    for (const ConversionParameter& parameter : parameters_of(conversion)) {
      double ProjectionParameters::*const member =
          parameter.role ? member_of(*parameter.role) : nullptr;
      if (member == nullptr) return std::nullopt;
      known.parameters.*member = parameter.value;
    }
    if (row.condition == Condition::origin_on_equator && known.parameters.latitude != 0) break;
    return known;
  }
  return std::nullopt;
}

std::string proj_pipeline_of(const CrsDefinition& definition) {
  PJ_CONTEXT* const context = proj_context();
  proj_complaint();
  const ProjObject crs = proj_crs_of_text(definition.wkt);
  const ProjObject base = proj_crs_of_text(definition.base_wkt);
  if (crs != nullptr && base != nullptr) {
    const ProjOwned<PJ_OPERATION_FACTORY_CONTEXT> factory(
        proj_create_operation_factory_context(context, nullptr));
    const ProjOwned<PJ_OBJ_LIST> list(
        proj_create_operations(context, base.get(), crs.get(), factory.get()));
    const ProjObject first(list != nullptr ? proj_list_get(context, list.get(), 0) : nullptr);
    const ProjObject normal(
        first != nullptr ? proj_normalize_for_visualization(context, first.get()) : nullptr);
    const char* const text = normal != nullptr
                                 ? proj_as_proj_string(context, normal.get(), PJ_PROJ_5, nullptr)
                                 : nullptr;
    if (text != nullptr) {
      check_proj_database();
      return text;
    }
  }
  check_proj_database();
  const std::string reason = proj_complaint();
  throw CrsError("PROJ cannot compute the projection of the CRS " + definition.title() +
                     (reason.empty() ? "" : ": " + reason),
                 stream::message("give another with {crs} EPSG:n"));
}

std::shared_ptr<const Projection> proj_projection_of(const CrsDefinition& definition) {
  return std::make_shared<ProjProjection>(proj_pipeline_of(definition), definition.degrees_per_unit,
                                          definition.metres_per_unit);
}

std::shared_ptr<const Projection> projection_of(const CrsDefinition& definition) {
  if (!definition.method) return proj_projection_of(definition);
  try {
    return make_projection(*definition.method, definition.parameters, definition.ellipsoid);
  } catch (const std::invalid_argument& error) {
    throw CrsError("the CRS " + definition.title() + " has no usable projection: " + error.what(),
                   stream::message("give another with {crs} EPSG:n"));
  }
}

}  // namespace terrace::terrain
