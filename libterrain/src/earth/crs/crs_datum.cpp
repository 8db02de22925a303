// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>

#include "earth/crs/crs_definition.hpp"
#include "earth/crs/epsg_table.hpp"
#include "earth/crs/wkt.hpp"

namespace terrace::terrain {
namespace {

/// ESRI's names and short ones, which the dataset does not have.
constexpr std::array<std::pair<std::string_view, int>, 26> kDatumNames{{
    {"wgs84", 4326},
    {"wgs1984", 4326},
    {"worldgeodeticsystem1984", 4326},
    {"etrs89", 4258},
    {"etrs1989", 4258},
    {"europeanterrestrialreferencesystem1989", 4258},
    {"nad83", 4269},
    {"northamerican1983", 4269},
    {"northamericandatum1983", 4269},
    {"northamerican1983harn", 4152},
    {"nad1983harn", 4152},
    {"nad1983nsrs2007", 4759},
    {"nad19832011", 6318},
    {"northamerican1983csrs", 4617},
    {"rgf1993", 4171},
    {"gda1994", 4283},
    {"gda2020", 7844},
    {"nzgd2000", 4167},
    {"jgd2000", 4612},
    {"jgd2011", 6668},
    {"sirgas2000", 4674},
    {"swerefs99", 4619},
    {"sweref99", 4619},
    {"europeandatum1950", 4230},
    {"european1950", 4230},
    {"northamerican1927", 4267},
}};

std::string plain_datum(std::string_view name) {
  std::string_view short_name = name;
  if (short_name.starts_with("D_") || short_name.starts_with("d_")) short_name.remove_prefix(2);
  std::string plain = plain_name(short_name);
  constexpr std::string_view kEnsemble = "ensemble";
  if (plain.ends_with(kEnsemble)) plain.resize(plain.size() - kEnsemble.size());
  return plain;
}

const EpsgGeographic* row_of_datum(const std::string& name) {
  const std::string plain = plain_datum(name);
  if (plain.empty()) return nullptr;
  for (const auto& [known, code] : kDatumNames) {
    if (plain == known) return epsg_geographic(code);
  }
  for (const EpsgGeographic& row : epsg_tables().geographic) {
    if (!row.has_height && plain == plain_datum(row.datum)) return &row;
  }
  return nullptr;
}

}  // namespace

void recognise_datum(CrsDefinition& definition) {
  const EpsgGeographic* row = epsg_geographic(definition.base_epsg);
  if (row == nullptr) row = row_of_datum(definition.datum);
  if (row == nullptr) row = row_of_datum(definition.base_name);
  if (row == nullptr) return;
  // A name does not make it that datum where the ellipsoid is another.
  const Ellipsoid& known = epsg_tables().ellipsoids[static_cast<std::size_t>(row->ellipsoid)];
  const Ellipsoid& own = definition.ellipsoid;
  if (std::abs(known.semi_major - own.semi_major) > 1e-9 * known.semi_major ||
      std::abs(known.flattening() - own.flattening()) > 1e-9) {
    definition.base_epsg = 0;
    return;
  }
  definition.base_epsg = row->code;
  definition.uncertainty = row->uncertainty;
  definition.datum = row->datum;
  // Zeros do not shift anything: they say that the datum is WGS 84's.
  if (definition.shift == DatumShift{} && row->uncertainty >= 0) definition.shift.reset();
}

}  // namespace terrace::terrain
