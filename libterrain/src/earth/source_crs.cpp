// SPDX-License-Identifier: Apache-2.0
#include "earth/source_crs.hpp"

#include <cmath>
#include <utility>
#include <variant>

#include <fmt/core.h>

#include "earth/crs/definition.hpp"
#include "earth/ground.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::terrain {
namespace {

/// Returns nullopt for a local system, which it stores in `local`.
std::optional<CoordinateSystem> read_sidecar(const std::string& file, const std::string& contents,
                                             std::optional<LocalCrs>& local) {
  try {
    AnyCrs system = crs_of_contents(contents);
    if (auto* const definition = std::get_if<CrsDefinition>(&system)) {
      return CoordinateSystem(*definition);
    }
    local = std::get<LocalCrs>(std::move(system));
    return std::nullopt;
  } catch (const CrsError& error) {
    throw stream::Error(file, error.what())
        .remedy(stream::message("correct or remove it, or name the system: {crs} EPSG:n"));
  }
}

/// Returns the CRS of the .prj files, which must agree. local: receives a system without a place on
/// the earth. note: receives what the user should know about the files.
std::optional<CoordinateSystem> system_of_sidecars(const stream::SourceInfo& info,
                                                   std::string& name,
                                                   std::optional<LocalCrs>& local,
                                                   stream::Message& note) {
  std::optional<CoordinateSystem> system;
  for (const std::string& file : info.files) {
    const std::string sidecar = stream::prj_beside(file);
    if (sidecar.empty()) continue;
    const std::string contents = contents_of_file(sidecar);
    if (contents.empty()) {
      note = fmt::format("{} is empty, so it does not name a CRS", sidecar);
      continue;
    }
    const std::optional<CoordinateSystem> other = read_sidecar(sidecar, contents, local);
    if (!other) continue;
    if (system && !system->same_places(*other)) {
      throw stream::Error(sidecar, fmt::format("its CRS differs from that of {}", name))
          .remedy(
              stream::message("convert one of the files, or name the CRS of all: {crs} EPSG:n"));
    }
    if (!system) {
      system = other;
      name = sidecar;
    }
  }
  return system;
}

SourceCrs read_source_crs(const stream::SourceInfo& info, const std::optional<DatumShift>& shift) {
  SourceCrs found;
  found.crs = info.crs;
  found.crs.geo_keys.clear();
  const std::string file = info.files.empty() ? std::string() : info.files.front();
  std::optional<LocalCrs> local;
  try {
    std::optional<AnyCrs> file_crs = crs_of_record(info.crs);
    if (file_crs && std::holds_alternative<LocalCrs>(*file_crs)) {
      local = std::get<LocalCrs>(*std::move(file_crs));
    } else if (file_crs) {
      found.system.emplace(std::get<CrsDefinition>(*file_crs));
    }
  } catch (const ContradictoryCrs& error) {
    throw stream::Error(file, error.what()).remedy(error.remedy());
  } catch (const CrsError& error) {
    // A system without a unit does not even determine distances.
    if (!info.crs.geographic && !metres_in_unit(info.crs.horizontal_unit)) {
      throw stream::Error(file, error.what()).remedy(error.remedy());
    }
    found.note = stream::message("{}: functions that need places on the earth will fail ({})",
                                 error.what(), error.remedy());
    return found;
  }
  std::string sidecar;
  if (!found.system) {
    if (!local) found.system = system_of_sidecars(info, sidecar, local, found.note);
  } else if (!info.crs.geo_keys.empty()) {
    // A file with its own CRS needs no .prj file. If there is one, it must agree.
    const std::optional<CoordinateSystem> other =
        system_of_sidecars(info, sidecar, local, found.note);
    if (other && !other->same_places(*found.system)) {
      throw stream::Error(file, fmt::format("its CRS is {}, that of {} is {}",
                                            found.system->title(), sidecar, other->title()))
          .remedy(stream::message("remove the wrong one, or say which is meant: {crs} EPSG:n"));
    }
  }
  if (!found.system) {
    if (local) {
      const stream::Crs& record = local->crs;
      found.crs.epsg = 0;
      found.crs.name = record.name;
      found.crs.wkt = record.wkt;
      if (found.crs.horizontal_unit.empty()) found.crs.horizontal_unit = record.horizontal_unit;
      if (found.crs.vertical_unit.empty()) found.crs.vertical_unit = record.vertical_unit;
      if (local->is_geocentric) {
        found.note = fmt::format(
            "the CRS \"{}\" is geocentric, with x, y and z from the centre of the earth: z is not "
            "a height, and functions that need a terrain will fail",
            record.name);
        return found;
      }
    }
    if (info.crs.vertical_epsg != 0) {
      CrsDefinition heights;
      try {
        set_vertical_epsg(heights, info.crs.vertical_epsg);
        found.heights = heights.heights;
      } catch (const CrsError& error) {
        found.note = stream::message("{} ({})", error.what(), error.remedy());
      }
    }
    return found;
  }
  if (shift) {
    CrsDefinition shifted = found.system->definition();
    if (found.system->counts_as_wgs84()) {
      throw stream::Error(file, fmt::format("its CRS {} counts as WGS 84 and takes no shift",
                                            found.system->title()))
          .remedy(stream::message("leave {shift} out"));
    }
    shifted.shift = shift;
    found.system.emplace(shifted);
  }
  const std::string vertical_unit = found.crs.vertical_unit;
  found.crs = found.system->crs();
  if (!vertical_unit.empty()) found.crs.vertical_unit = vertical_unit;
  found.heights = found.system->heights();
  return found;
}

/// Throws: stream::Error if the columns of x and y name another unit than that of the CRS.
void check_unit_of_columns(const stream::SourceInfo& info, const SourceCrs& found) {
  constexpr char kDegree[] = "degree";
  const std::string& unit = info.coordinates[0].unit;
  const std::string& of_crs = found.crs.horizontal_unit;
  const auto metres = metres_in_unit(unit);
  const auto known = found.system && !found.crs.geographic
                         ? std::optional(found.system->metres_per_unit())
                         : metres_in_unit(of_crs);
  const bool degrees = unit == kDegree;
  if ((!metres && !degrees) || (!known && !found.crs.geographic)) return;
  // Few authors of tables distinguish feet from US survey feet.
  const double tolerance = unit == "foot" ? 1e-5 : 1e-8;
  if (found.crs.geographic ? degrees : metres && std::abs(*known / *metres - 1) <= tolerance) {
    return;
  }
  const std::string crs = found.system ? found.system->title() : '"' + found.crs.name + '"';
  throw stream::Error(
      info.files.empty() ? std::string() : info.files.front(),
      fmt::format("x and y are in {} by the names of their columns, but the CRS {} is in {}",
                  plural_unit(unit), crs, of_crs.empty() ? "another unit" : plural_unit(of_crs)))
      .remedy(stream::message(
          "name the CRS of these numbers with {crs} EPSG:n, or rename the columns"));
}

}  // namespace

SourceCrs crs_of_source(const stream::SourceInfo& info, const std::optional<DatumShift>& shift) {
  SourceCrs found = read_source_crs(info, shift);
  check_unit_of_columns(info, found);
  return found;
}

}  // namespace terrace::terrain
