// SPDX-License-Identifier: Apache-2.0
#include "earth/geoid_heights.hpp"

#include <cmath>
#include <filesystem>
#include <string_view>
#include <system_error>

#include <GeographicLib/Geoid.hpp>
#include <fmt/core.h>

#include "earth/crs/definition.hpp"
#include "earth/crs/operation_choice.hpp"
#include "earth/crs/proj_object.hpp"
#include "earth/ground.hpp"
#include "earth/polynomial_patch.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::terrain {

GeoidGrid::GeoidGrid(const std::string& file, std::uint64_t memory_bytes) {
  const std::filesystem::path path(file);
  const auto fault = [&file](std::string cause) {
    return stream::Error(file, std::move(cause))
        .remedy("pass a grid of GeographicLib, such as egm2008-5.pgm");
  };
  if (path.extension() != ".pgm") throw fault("is not named like a geoid grid (.pgm)");
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(path, error);
  if (error) throw fault("cannot be read: " + error.message());
  if (bytes > memory_bytes) {
    throw stream::Error(file, stream::message("takes {}M of memory, {}M of {memory_bytes} are left",
                                              (bytes >> 20) + 1, memory_bytes >> 20))
        .remedy(stream::message("raise {memory_bytes} or use a coarser grid"));
  }
  try {
    const std::filesystem::path folder =
        path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
    constexpr bool kCubic = true, kForThreads = true;
    geoid_ = std::make_unique<const GeographicLib::Geoid>(path.stem().string(), folder.string(),
                                                          kCubic, kForThreads);
  } catch (const std::exception& damage) {
    throw fault(fmt::format("is not a geoid grid: {}", damage.what()));
  }
}

GeoidGrid::~GeoidGrid() = default;
GeoidGrid::GeoidGrid(GeoidGrid&&) noexcept = default;
GeoidGrid& GeoidGrid::operator=(GeoidGrid&&) noexcept = default;

double GeoidGrid::undulation(const Point2& place) const { return (*geoid_)(place[1], place[0]); }

EllipsoidalHeights::EllipsoidalHeights(const stream::StoreSchema& schema, HeightReference vertical,
                                       const std::string& geoid, std::uint64_t memory_bytes,
                                       const std::optional<GeographicArea>& area) {
  const bool ignored = vertical == HeightReference::ignore;
  const bool orthometric = vertical == HeightReference::orthometric;
  if ((ignored || vertical == HeightReference::ellipsoidal) && !geoid.empty()) {
    throw UsageError(stream::message(
        "{vertical} {} takes heights as they are, {geoid} converts them: give one of the two",
        ignored ? "ignore" : "ellipsoidal"));
  }
  const std::string& recorded = schema.vertical;
  if (recorded == "ellipsoidal" && (!geoid.empty() || orthometric)) {
    throw UsageError(stream::message(
        "the store's heights are already ellipsoidal: leave {} out, or build the store with "
        "{vertical} orthometric if they are not",
        geoid.empty() ? stream::message("{vertical} orthometric") : stream::message("{geoid}")));
  }
  if (recorded != "ellipsoidal" && vertical == HeightReference::recorded && geoid.empty()) {
    throw UsageError(stream::message(
        "{}, and globes want heights above the ellipsoid: give {vertical} orthometric (by the "
        "store's vertical CRS, or EGM96), {geoid} FILE (a GeographicLib geoid grid), {vertical} "
        "ellipsoidal if they are that, or {vertical} ignore",
        recorded.empty() ? "the store does not say what its heights refer to"
                         : "the store's heights are " + recorded));
  }
  // Use the same unit as all other functions, with the same assumption.
  const Ground ground(schema);
  metres_per_unit_ = ground.metres_vertical();
  if (!metres_in_unit(schema.coordinates[2].unit) && !metres_in_unit(schema.crs.vertical_unit)) {
    note_ = ground.assumption().empty() ? "the unit of heights is unknown and taken as metres"
                                        : ground.assumption();
  }
  if (!geoid.empty()) {
    geoid_.emplace(geoid, memory_bytes);
  } else if (orthometric) {
    find_operation(schema, area);
  }
  if (ignored && recorded != "ellipsoidal") {
    add_note("heights are taken as ellipsoidal though they are " +
             (recorded.empty() ? std::string("of unknown reference") : recorded) +
             ": they may be off by up to about 100 m");
  }
  if (recorded.empty() && geoid_) add_note("heights of unknown reference are taken as orthometric");
}

void EllipsoidalHeights::add_note(const std::string& what) {
  note_ += (note_.empty() ? "" : "; ") + what;
}

void EllipsoidalHeights::find_operation(const stream::StoreSchema& schema,
                                        const std::optional<GeographicArea>& area) {
  constexpr int kEgm96 = 5773;
  std::string name;
  OperationChoice choice;
  try {
    const std::optional<CrsDefinition> definition = definition_of(schema.crs);
    CrsDefinition heights;
    if (definition && definition->heights == Heights::orthometric &&
        !definition->height_wkt.empty()) {
      heights = *definition;
    } else {
      set_vertical_epsg(heights, schema.crs.vertical_epsg != 0 ? schema.crs.vertical_epsg : kEgm96);
      if (schema.crs.vertical_epsg == 0) add_note("heights are taken as above EGM96");
    }
    name = heights.vertical_name;
    const ProjObject vertical = proj_crs_of_text(heights.height_wkt);
    const ProjObject places = proj_crs_of_code("EPSG", "4326"),
                     target = proj_crs_of_code("EPSG", "4979");
    const ProjObject source(
        proj_create_compound_crs(proj_context(), name.c_str(), places.get(), vertical.get()));
    choice = choose_operation(source.get(), target.get(), area);
    if (choice.found) operation_.emplace(choice.pipeline);
  } catch (const CrsError& error) {
    throw stream::Error("", error.what()).at("heights").remedy(error.remedy());
  }
  if (!operation_) {
    throw stream::Error("", "no operation leads from " + name + " to the ellipsoid" +
                                (choice.better.empty() ? "" : ": " + choice.better))
        .at("heights")
        .remedy(
            choice.better.empty()
                ? stream::message("give {geoid} FILE (a GeographicLib geoid grid)")
                : stream::message("install that grid where PROJ finds it, or give {geoid} FILE (a "
                                  "GeographicLib geoid grid)"));
  }
  add_note(name + " to the ellipsoid by " + quoted_with_accuracy(choice.name, choice.accuracy) +
           (choice.better.empty() ? "" : " (" + choice.better + ")"));
}

void EllipsoidalHeights::convert(std::span<const Point2> places, std::span<double> heights) const {
  for (double& height : heights) height *= metres_per_unit_;
  add_geoid(places, heights);
}

void EllipsoidalHeights::add_geoid(std::span<const Point2> places,
                                   std::span<double> heights) const {
  if (!has_geoid()) return;
  add_smooth_offsets(places, heights, kTolerance,
                     [this](std::span<const Point2> at, std::span<double> out) {
                       if (operation_) {
                         operation_->add_heights(at, out);
                         return;
                       }
                       for (std::size_t i = 0; i < out.size(); ++i) {
                         if (!std::isnan(out[i])) out[i] += geoid_->undulation(at[i]);
                       }
                     });
}

void EllipsoidalHeights::add_to(Digest& digest) const {
  digest.add(metres_per_unit_);
  digest.add(std::uint64_t{has_geoid()});
  if (operation_) digest.add(std::string_view(operation_->definition()));
}

}  // namespace terrace::terrain
