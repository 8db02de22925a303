// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <span>
#include <string>

#include "earth/crs/projection.hpp"

/// The coordinate reference systems that the command knows by EPSG code: those of the dataset that
/// are not deprecated and have a method of projection.hpp. The rows are generated
/// (make_epsg_table.py); a test compares every one of them with PROJ where that is installed.

namespace terrace::terrain {

struct EpsgGeographic {
  int code;
  int ellipsoid;            ///< row of EpsgTables::ellipsoids
  double prime_meridian;    ///< degrees east of Greenwich
  double degrees_per_unit;  ///< of longitude and latitude
  double uncertainty;       ///< metres if it is taken as WGS 84; negative: another datum
  bool has_height;          ///< three dimensions, the third an ellipsoidal height
  const char* name;
  const char* datum;
};

struct EpsgConversion {
  int code;
  ProjectionMethod method;
  ProjectionParameters parameters;
  const char* name;
};

struct EpsgProjected {
  int code;
  int base;  ///< code of the geographic system
  int conversion;
  double metres_per_unit;
  const char* name;  ///< nullptr: "BASE / CONVERSION"
};

struct EpsgVertical {
  int code;
  double metres_per_unit;
  const char* name;
};

struct EpsgCompound {
  int code;
  int horizontal, vertical;
};

/// All rows, those with a code in ascending order of it.
struct EpsgTables {
  std::span<const Ellipsoid> ellipsoids;
  std::span<const EpsgGeographic> geographic;
  std::span<const EpsgConversion> conversions;
  std::span<const EpsgProjected> projected;
  std::span<const EpsgVertical> vertical;
  std::span<const EpsgCompound> compound;
};
const EpsgTables& epsg_tables();

/// The row of that code; nullptr if there is none. O(log rows).
const EpsgGeographic* epsg_geographic(int code);
const EpsgConversion* epsg_conversion(int code);
const EpsgProjected* epsg_projected(int code);
const EpsgVertical* epsg_vertical(int code);
const EpsgCompound* epsg_compound(int code);

std::string name_of(const EpsgProjected& row);

}  // namespace terrace::terrain
