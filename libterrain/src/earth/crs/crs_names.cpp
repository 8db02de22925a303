// SPDX-License-Identifier: GPL-3.0-or-later
#include "earth/crs/crs_names.hpp"

#include <array>
#include <cassert>
#include <cmath>
#include <string>
#include <utility>

#include "earth/crs/wkt.hpp"

namespace terrace::terrain {
namespace {

using P = ProjectionParameters;
using NameKind = ParameterName::Kind;
using M = ProjectionMethod;

constexpr ParameterName kNatural[] = {
    {&P::latitude, NameKind::angle, "Latitude of natural origin", 8801},
    {&P::longitude, NameKind::angle, "Longitude of natural origin", 8802},
    {&P::scale, NameKind::scale, "Scale factor at natural origin", 8805},
    {&P::false_easting, NameKind::length, "False easting", 8806},
    {&P::false_northing, NameKind::length, "False northing", 8807}};
constexpr ParameterName kUnscaled[] = {kNatural[0], kNatural[1], kNatural[3], kNatural[4]};
constexpr ParameterName kTwoParallels[] = {
    {&P::latitude, NameKind::angle, "Latitude of false origin", 8821},
    {&P::longitude, NameKind::angle, "Longitude of false origin", 8822},
    {&P::parallel1, NameKind::angle, "Latitude of 1st standard parallel", 8823},
    {&P::parallel2, NameKind::angle, "Latitude of 2nd standard parallel", 8824},
    {&P::false_easting, NameKind::length, "Easting at false origin", 8826},
    {&P::false_northing, NameKind::length, "Northing at false origin", 8827}};
constexpr ParameterName kPolarB[] = {
    {&P::parallel1, NameKind::angle, "Latitude of standard parallel", 8832},
    {&P::longitude, NameKind::angle, "Longitude of origin", 8833},
    kNatural[3],
    kNatural[4]};
constexpr ParameterName kMercatorB[] = {kTwoParallels[2], kNatural[1], kNatural[3], kNatural[4]};
constexpr ParameterName kHotineA[] = {
    {&P::latitude, NameKind::angle, "Latitude of projection centre", 8811},
    {&P::longitude, NameKind::angle, "Longitude of projection centre", 8812},
    {&P::azimuth, NameKind::angle, "Azimuth of initial line", 8813},
    {&P::skew, NameKind::angle, "Angle from Rectified to Skew Grid", 8814},
    {&P::scale, NameKind::scale, "Scale factor on initial line", 8815},
    kNatural[3],
    kNatural[4]};
constexpr ParameterName kHotineB[] = {
    kHotineA[0],
    kHotineA[1],
    kHotineA[2],
    kHotineA[3],
    kHotineA[4],
    {&P::false_easting, NameKind::length, "Easting at projection centre", 8816},
    {&P::false_northing, NameKind::length, "Northing at projection centre", 8817}};

constexpr MethodName kMethods[] = {
    {M::transverse_mercator, "Transverse Mercator", 9807, kNatural},
    {M::lambert_1sp, "Lambert Conic Conformal (1SP)", 9801, kNatural},
    {M::lambert_2sp, "Lambert Conic Conformal (2SP)", 9802, kTwoParallels},
    {M::albers, "Albers Equal Area", 9822, kTwoParallels},
    {M::polar_stereographic_a, "Polar Stereographic (variant A)", 9810, kNatural},
    {M::polar_stereographic_b, "Polar Stereographic (variant B)", 9829, kPolarB},
    {M::lambert_azimuthal, "Lambert Azimuthal Equal Area", 9820, kUnscaled},
    {M::web_mercator, "Popular Visualisation Pseudo Mercator", 1024, kUnscaled},
    {M::mercator_a, "Mercator (variant A)", 9804, kNatural},
    {M::mercator_b, "Mercator (variant B)", 9805, kMercatorB},
    {M::oblique_stereographic, "Oblique Stereographic", 9809, kNatural},
    {M::hotine_a, "Hotine Oblique Mercator (variant A)", 9812, kHotineA},
    {M::hotine_b, "Hotine Oblique Mercator (variant B)", 9815, kHotineB}};

/// Names besides EPSG's: OGC's, GDAL's and ESRI's.
constexpr std::pair<const char*, M> kOtherNames[] = {
    {"gausskruger", M::transverse_mercator},
    {"lambertconformalconic1sp", M::lambert_1sp},
    {"lambertconformalconic2sp", M::lambert_2sp},
    {"albersconicequalarea", M::albers},
    {"albers", M::albers},
    {"mercatorauxiliarysphere", M::web_mercator},
    {"mercator1sp", M::mercator_a},
    {"mercator2sp", M::mercator_b},
    {"doublestereographic", M::oblique_stereographic},
    {"hotineobliquemercator", M::hotine_a},
    {"hotineobliquemercatorazimuthnaturalorigin", M::hotine_a},
    {"rectifiedskeworthomorphicnaturalorigin", M::hotine_a},
    {"hotineobliquemercatorazimuthcenter", M::hotine_b},
    {"rectifiedskeworthomorphiccenter", M::hotine_b},
    {"obliquemercator", M::hotine_b},
    {"stereographicnorthpole", M::polar_stereographic_b},
    {"stereographicsouthpole", M::polar_stereographic_b}};

constexpr std::pair<const char*, const ParameterName*> kOtherParameters[] = {
    {"latitudeoforigin", &kNatural[0]},
    {"latitudeofcenter", &kNatural[0]},
    {"latitudeofcentre", &kNatural[0]},
    {"centralmeridian", &kNatural[1]},
    {"longitudeofcenter", &kNatural[1]},
    {"longitudeofcentre", &kNatural[1]},
    {"scalefactor", &kNatural[2]},
    {"scalefactoratprojectioncentre", &kNatural[2]},
    {"standardparallel1", &kTwoParallels[2]},
    {"standardparallel2", &kTwoParallels[3]},
    {"azimuth", &kHotineA[2]},
    {"azimuthatprojectioncentre", &kHotineA[2]},
    {"rectifiedgridangle", &kHotineA[3]},
    {"xyplanerotation", &kHotineA[3]}};

}  // namespace

const MethodName& method_name(ProjectionMethod method) {
  for (const MethodName& row : kMethods) {
    if (row.method == method) return row;
  }
  assert(false);
  return kMethods[0];
}

std::optional<ProjectionMethod> method_of_epsg(int code) {
  for (const MethodName& row : kMethods) {
    if (row.code == code) return row.method;
  }
  return std::nullopt;
}

std::optional<ProjectionMethod> method_of_name(std::string_view name, bool has_first,
                                               bool has_second, double latitude) {
  const std::string plain = plain_name(name);
  if (plain == "lambertconformalconic") return has_second ? M::lambert_2sp : M::lambert_1sp;
  if (plain == "mercator") return has_first ? M::mercator_b : M::mercator_a;
  if (plain == "polarstereographic") {
    return std::abs(latitude) == 90 ? M::polar_stereographic_a : M::polar_stereographic_b;
  }
  for (const MethodName& row : kMethods) {
    if (plain == plain_name(row.name)) return row.method;
  }
  for (const auto& [other, method] : kOtherNames) {
    if (plain == other) return method;
  }
  return std::nullopt;
}

const ParameterName* parameter_of_name(std::string_view name) {
  const std::string plain = plain_name(name);
  for (const MethodName& row : kMethods) {
    for (const ParameterName& parameter : row.parameters) {
      if (plain == plain_name(parameter.name)) return &parameter;
    }
  }
  for (const auto& [other, parameter] : kOtherParameters) {
    if (plain == other) return parameter;
  }
  return nullptr;
}

}  // namespace terrace::terrain
