// SPDX-License-Identifier: Apache-2.0 Checks every projected system of the EPSG dataset in PROJ's
// database. It can be read, its WKT reads back, and conversion to it can be reversed. GeographicLib
// and PROJ agree where both support it.
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <iostream>
#include <mutex>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <proj.h>

#include "earth/crs/definition.hpp"
#include "earth/crs/projection_engine.hpp"
#include "terrace/terrain/crs.hpp"

namespace terrace::terrain {
namespace {

struct Code {
  int code = 0;
  GeographicArea area;
  bool has_area = false;
};

std::vector<Code> projected_codes() {
  PJ_CONTEXT* const context = proj_context_create();
  PROJ_CRS_LIST_PARAMETERS* const wanted = proj_get_crs_list_parameters_create();
  const PJ_TYPE type = PJ_TYPE_PROJECTED_CRS;
  wanted->types = &type;
  wanted->typesCount = 1;
  wanted->allow_deprecated = 1;
  int count = 0;
  PROJ_CRS_INFO** const list =
      proj_get_crs_info_list_from_database(context, "EPSG", wanted, &count);
  std::vector<Code> codes;
  for (int i = 0; i < count; ++i) {
    const PROJ_CRS_INFO& row = *list[i];
    if (std::string(row.code) == "900913") continue;  // an alias of 3857
    codes.push_back({.code = std::stoi(row.code),
                     .area = {row.west_lon_degree, row.south_lat_degree, row.east_lon_degree,
                              row.north_lat_degree},
                     .has_area = row.bbox_valid != 0});
  }
  proj_crs_info_list_destroy(list);
  proj_get_crs_list_parameters_destroy(wanted);
  proj_context_destroy(context);
  return codes;
}

/// Returns places slightly inside the area of use, with longitudes from `meridian`.
std::array<Point2, 5> places_in(GeographicArea area, double meridian) {
  if (area.east < area.west) area.east += 360;
  constexpr std::array<Point2, 5> kShares{
      {{0.5, 0.5}, {0.01, 0.01}, {0.99, 0.01}, {0.01, 0.99}, {0.99, 0.99}}};
  std::array<Point2, 5> places{};
  for (std::size_t i = 0; i < places.size(); ++i) {
    const double longitude = area.west + kShares[i][0] * (area.east - area.west) - meridian;
    places[i] = {std::remainder(longitude, 360.0),
                 area.south + kShares[i][1] * (area.north - area.south)};
  }
  return places;
}

/// Systems with a method that PROJ 9.1 does not support; later versions may.
constexpr std::array<int, 33> kBeyondProj{
    // Lambert conformal conic, west orientated
    2218, 2221, 2296, 2297, 2298, 2299, 2300, 2301, 2302, 2303, 2304, 2305, 2306, 2307, 3052, 3053,
    3144, 3145, 3173,
    // Bonne, south orientated
    2963, 5017,
    // polar stereographic, variant C
    2985, 2986, 7082,
    // Krovak modified
    5224, 5225, 5515, 5516,
    // Tunisia mining grid, Lambert near-conformal
    22300, 22700,
    // grids of zones, which are not on a single plane
    32600, 32700,
    // Mercator with a scale at a latitude other than the equator (deprecated, replaced by 3994)
    3752};
/// Laborde's projection: PROJ's inverse is off by some centimetres at the ends of Madagascar.
constexpr std::array<int, 2> kInexactInverse{8441, 29701};

bool is_one_of(std::span<const int> codes, int code) {
  return std::find(codes.begin(), codes.end(), code) != codes.end();
}

struct Findings {
  std::vector<std::string> faults;
  std::size_t refused = 0, places = 0, compared = 0;
  double worst = 0;  ///< in metres, between GeographicLib and PROJ

  void fault(int code, const std::string& what) {
    faults.push_back("EPSG:" + std::to_string(code) + ": " + what);
  }
};

void check(const Code& row, Findings& found) {
  CrsDefinition definition;
  std::shared_ptr<const Projection> projection;
  try {
    definition = definition_of_epsg(row.code);
    projection = projection_of(definition);
    const CrsDefinition read = definition_of_contents(wkt_of(definition));
    if (!same_places(read, definition) || read.epsg() != row.code) {
      found.fault(row.code, "its WKT reads back as another system");
    }
    const CoordinateSystem system(definition);
    if (!mean_the_same(system.crs_with_wkt1().wkt, wkt_of(definition))) {
      found.fault(row.code, "the WKT written to LAS reads back as another system");
    }
  } catch (const CrsError& error) {
    ++found.refused;
    if (!is_one_of(kBeyondProj, row.code)) found.fault(row.code, error.what());
    return;
  }
  // A few deprecated systems.
  if (!row.has_area) return;
  const std::array<Point2, 5> degrees = places_in(row.area, definition.prime_meridian);
  std::array<Point2, 5> plane = degrees;
  projection->forward(plane);
  std::array<Point2, 5> back = plane;
  projection->reverse(back);
  for (std::size_t i = 0; i < degrees.size(); ++i) {
    if (std::isnan(plane[i][0])) {
      // Corners of a rectangle around an area may be outside the projection's range.
      if (i == 0) found.fault(row.code, "its middle has no place");
      continue;
    }
    ++found.places;
    const double turn = std::remainder(back[i][0] - degrees[i][0], 360.0);
    const double across = turn * std::cos(degrees[i][1] * 3.14159265358979 / 180);
    // Micrometres for GeographicLib, two millimetres for PROJ's series.
    const double exact = is_one_of(kInexactInverse, row.code) ? 1e-6
                         : definition.method                  ? 1e-10
                                                              : 2e-8;
    if (!(std::abs(back[i][1] - degrees[i][1]) < exact && std::abs(across) < exact)) {
      found.fault(row.code,
                  "its places do not come back: off by " +
                      std::to_string(std::hypot(across, back[i][1] - degrees[i][1]) * 111e3) +
                      " m");
    }
  }
  if (!definition.method) return;
  std::array<Point2, 5> by_proj = degrees;
  proj_projection_of(definition)->forward(by_proj);
  for (std::size_t i = 0; i < degrees.size(); ++i) {
    if (std::isnan(plane[i][0]) || std::isnan(by_proj[i][0])) continue;
    ++found.compared;
    const double off =
        std::max(std::abs(plane[i][0] - by_proj[i][0]), std::abs(plane[i][1] - by_proj[i][1]));
    found.worst = std::max(found.worst, off);
    if (!(off < 1e-3)) {
      found.fault(row.code, "PROJ says something else: off by " + std::to_string(off) + " m");
    }
  }
}

TEST(Epsg, AllProjectedSystemsWorkAndLibrariesAgree) {
  const std::vector<Code> codes = projected_codes();
  ASSERT_GT(codes.size(), 5000u);
  std::atomic<std::size_t> next = 0;
  std::mutex mutex;
  Findings all;
  {
    std::vector<std::jthread> threads;
    for (unsigned i = 0; i < std::clamp(std::thread::hardware_concurrency(), 2U, 8U); ++i) {
      threads.emplace_back([&] {
        Findings own;
        constexpr std::size_t kShare = TERRACE_TEST_SHARE;
        for (std::size_t row = kShare * next++; row < codes.size(); row = kShare * next++) {
          check(codes[row], own);
        }
        const std::scoped_lock lock(mutex);
        all.faults.insert(all.faults.end(), own.faults.begin(), own.faults.end());
        all.refused += own.refused;
        all.places += own.places;
        all.compared += own.compared;
        all.worst = std::max(all.worst, own.worst);
      });
    }
  }
  std::sort(all.faults.begin(), all.faults.end());
  for (const std::string& fault : all.faults) ADD_FAILURE() << fault;
  EXPECT_GT(all.places, 4 * codes.size() / TERRACE_TEST_SHARE);
  EXPECT_GT(all.compared, 4 * codes.size() / 2 / TERRACE_TEST_SHARE);
  EXPECT_LE(all.refused, kBeyondProj.size());
  std::cout << codes.size() << " codes, " << all.refused << " of them beyond PROJ, " << all.places
            << " places, " << all.compared << " of them by GeographicLib and PROJ: at most "
            << all.worst * 1e3 << " mm off\n";
}

}  // namespace
}  // namespace terrace::terrain
