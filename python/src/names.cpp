// SPDX-License-Identifier: Apache-2.0
#include "names.hpp"

#include <array>
#include <cstddef>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include <terrace/cluster/facility_location.hpp>
#include <terrace/cluster/linkage.hpp>
#include <terrace/matching/halving.hpp>
#include <terrace/stream/source.hpp>
#include <terrace/stream/spatial_order.hpp>
#include <terrace/terrain/fill.hpp>
#include <terrace/terrain/height_reference.hpp>
#include <terrace/terrain/input_triangles.hpp>
#include <terrace/terrain/raster.hpp>
#include <terrace/tri/grid_tin.hpp>
#include <terrace/tri/interpolation.hpp>
#include <terrace/tri/point_tin.hpp>
#include <terrace/tri/shape.hpp>
#include <terrace/tri/smoothing.hpp>
#include <terrace/tri/surface_smoothing.hpp>

#include "arrays.hpp"

namespace terrace::python {
namespace {

/// The names of an enumeration's enumerators.
template <class Enum>
struct NameTable {
  const char* type;       ///< in terrace/_names.py, which has the same names
  const char* parameter;  ///< that takes them
  std::vector<std::pair<std::string_view, Enum>> names;
};

const auto& tables() {
  using cluster::Effort, cluster::FacilityStrategy, cluster::LinkageMethod, matching::Halving;
  using stream::Entities, stream::HeightsOfColour, stream::Order;
  using terrain::Fill, terrain::HeightReference, terrain::RasterValue, terrain::SurfaceOrigin;
  using tri::GradientFrom, tri::Interpolation, tri::PointDuplicates, tri::ShapeCriterion;
  using tri::ShapeRule, tri::Smoothing, tri::SurfaceSmoothing, tri::TinQuality;
  static const std::tuple all{
      NameTable<Interpolation>{"Interpolation",
                               "method",
                               {{"linear", Interpolation::linear},
                                {"natural", Interpolation::natural_neighbour},
                                {"nearest", Interpolation::nearest}}},
      NameTable<GradientFrom>{
          "GradientMethod",
          "method",
          {{"linear", GradientFrom::triangles}, {"natural", GradientFrom::natural_neighbours}}},
      NameTable<TinQuality>{"Quality",
                            "quality",
                            {{"greedy", TinQuality::greedy},
                             {"removal", TinQuality::removal},
                             {"fitted", TinQuality::fitted}}},
      NameTable<PointDuplicates>{"Duplicates",
                                 "duplicates",
                                 {{"all", PointDuplicates::all},
                                  {"min", PointDuplicates::min},
                                  {"max", PointDuplicates::max},
                                  {"mean", PointDuplicates::mean},
                                  {"first", PointDuplicates::first},
                                  {"error", PointDuplicates::error}}},
      NameTable<Fill>{
          "Fill",
          "fill",
          {{"none", Fill::none}, {"flat", Fill::flat}, {"interpolate", Fill::interpolate}}},
      NameTable<Smoothing>{"Smoothing",
                           "method",
                           {{"laplacian", Smoothing::laplacian},
                            {"taubin", Smoothing::taubin},
                            {"bilateral", Smoothing::bilateral}}},
      NameTable<SurfaceSmoothing>{
          "SurfaceSmoothing",
          "method",
          {{"taubin", SurfaceSmoothing::taubin}, {"bilateral", SurfaceSmoothing::bilateral}}},
      NameTable<RasterValue>{"RasterValue",
                             "value",
                             {{"height", RasterValue::height},
                              {"slope", RasterValue::slope},
                              {"aspect", RasterValue::aspect},
                              {"hillshade", RasterValue::hillshade}}},
      NameTable<HeightReference>{"Vertical",
                                 "vertical",
                                 {{"recorded", HeightReference::recorded},
                                  {"ellipsoidal", HeightReference::ellipsoidal},
                                  {"orthometric", HeightReference::orthometric},
                                  {"ignore", HeightReference::ignore}}},
      NameTable<Effort>{"Effort",
                        "effort",
                        {{"fast", Effort::fast},
                         {"default", Effort::standard},
                         {"fine", Effort::fine},
                         {"full", Effort::full}}},
      NameTable<FacilityStrategy>{"ClusterMethod",
                                  "method",
                                  {{"fast", FacilityStrategy::fast},
                                   {"automatic", FacilityStrategy::automatic},
                                   {"full-scan", FacilityStrategy::full_scan},
                                   {"quadtree", FacilityStrategy::quadtree},
                                   {"octree", FacilityStrategy::octree},
                                   {"kd-tree", FacilityStrategy::kd_tree},
                                   {"facilities", FacilityStrategy::facilities},
                                   {"interchange", FacilityStrategy::interchange},
                                   {"jain-vazirani", FacilityStrategy::jain_vazirani},
                                   {"greedy-stars", FacilityStrategy::greedy_stars}}},
      NameTable<LinkageMethod>{"LinkageMethod",
                               "method",
                               {{"single", LinkageMethod::single},
                                {"complete", LinkageMethod::complete},
                                {"average", LinkageMethod::average},
                                {"weighted", LinkageMethod::weighted},
                                {"ward", LinkageMethod::ward},
                                {"centroid", LinkageMethod::centroid},
                                {"median", LinkageMethod::median}}},
      NameTable<Halving>{"HalvingMethod",
                         "method",
                         {{"monotone", Halving::monotone}, {"monte-carlo", Halving::monte_carlo}}},
      NameTable<Order>{
          "Order",
          "order",
          {{"auto", Order::automatic}, {"stream", Order::stream}, {"spatial", Order::spatial}}},
      NameTable<Entities>{"Entities",
                          "entities",
                          {{"points", Entities::points},
                           {"triangles", Entities::triangles},
                           {"segments", Entities::segments},
                           {"polylines", Entities::polylines}}},
      NameTable<SurfaceOrigin>{"SurfaceOrigin",
                               "surface",
                               {{"auto", SurfaceOrigin::automatic},
                                {"input", SurfaceOrigin::input},
                                {"restored", SurfaceOrigin::restored}}},
      NameTable<HeightsOfColour>{"HeightsOfColour",
                                 "heights_of_colour",
                                 {{"none", HeightsOfColour::none},
                                  {"mapbox", HeightsOfColour::mapbox},
                                  {"terrarium", HeightsOfColour::terrarium}}},
      NameTable<ShapeRule>{"ShapeRule",
                           "rule",
                           {{"poles", ShapeRule::poles},
                            {"flood", ShapeRule::flood},
                            {"published", ShapeRule::published}}},
      NameTable<ShapeCriterion>{
          "ShapeCriterion",
          "criterion",
          {{"gabriel", ShapeCriterion::gabriel}, {"edge-length", ShapeCriterion::edge_length}}},
      NameTable<ViewKind>{
          "ViewKind",
          "kind",
          {{"mesh", ViewKind::mesh}, {"points", ViewKind::points}, {"surface", ViewKind::surface}}},
      NameTable<ViewReader>{
          "ViewReader", "reader", {{"thread", ViewReader::thread}, {"frame", ViewReader::frame}}},
      NameTable<ModelKind>{
          "ModelKind", "kind", {{"mesh", ModelKind::mesh}, {"volume", ModelKind::volume}}}};
  return all;
}

/// Parameters that have different names in the libraries (first) and in the module.
constexpr std::array<std::pair<std::string_view, std::string_view>, 11> kParameters{{
    {"channel", "channels"},
    {"format", "input_format"},
    {"memory_bytes", "memory"},
    {"output_format", "format"},
    {"own_crs", "lonlat=False"},
    {"region_crs", "crs"},
    {"shift", "datum_shift"},
    {"strategy", "method"},
    {"surface_from", "surface"},
    {"to_crs", "crs"},
    {"zoom", "zooms"},
}};

}  // namespace

template <class Enum>
Enum named(const std::string& name) {
  const auto& table = std::get<NameTable<Enum>>(tables());
  std::string known;
  for (const auto& [text, value] : table.names) {
    if (text == name) return value;
    known += (known.empty() ? "" : ", ") + std::string(text);
  }
  throw py::value_error("`" + std::string(table.parameter) + "` must be one of " + known +
                        ", not '" + name + "'");
}

template <class Enum>
void take_named(const py::dict& options, const char* option, Enum& value) {
  if (!options.contains(option)) return;
  std::string name;
  take_option(options, option, name);
  value = named<Enum>(name);
}

// Calls in other sources need these.
template tri::Interpolation named(const std::string& name);
template tri::GradientFrom named(const std::string& name);
template tri::TinQuality named(const std::string& name);
template tri::Smoothing named(const std::string& name);
template tri::SurfaceSmoothing named(const std::string& name);
template tri::PointDuplicates named(const std::string& name);
template tri::ShapeRule named(const std::string& name);
template tri::ShapeCriterion named(const std::string& name);
template terrain::RasterValue named(const std::string& name);
template terrain::HeightReference named(const std::string& name);
template cluster::LinkageMethod named(const std::string& name);
template matching::Halving named(const std::string& name);
template ViewKind named(const std::string& name);
template ViewReader named(const std::string& name);
template ModelKind named(const std::string& name);
template void take_named(const py::dict&, const char*, cluster::Effort&);
template void take_named(const py::dict&, const char*, cluster::FacilityStrategy&);
template void take_named(const py::dict&, const char*, stream::Order&);
template void take_named(const py::dict&, const char*, stream::Entities&);
template void take_named(const py::dict&, const char*, stream::HeightsOfColour&);
template void take_named(const py::dict&, const char*, terrain::Fill&);
template void take_named(const py::dict&, const char*, terrain::HeightReference&);
template void take_named(const py::dict&, const char*, terrain::SurfaceOrigin&);
template void take_named(const py::dict&, const char*, tri::TinQuality&);
template void take_named(const py::dict&, const char*, tri::PointDuplicates&);

py::str message_of(const stream::Message& message) {
  return text_of(message.text([](std::string_view name) {
    const auto* const parameter = std::find_if(kParameters.begin(), kParameters.end(),
                                               [&](const auto& row) { return row.first == name; });
    return '`' + std::string(parameter == kParameters.end() ? name : parameter->second) + '`';
  }));
}

void bind_names(py::module_& module) {
  // For a test: the names of each type in terrace/_names.py.
  module.def("names", [] {
    py::dict all;
    std::apply(
        [&](const auto&... table) {
          const auto add = [&](const auto& of) {
            py::list names;
            for (const auto& entry : of.names) names.append(text_of(entry.first));
            all[of.type] = py::tuple(names);
          };
          (add(table), ...);
        },
        tables());
    return all;
  });
}

}  // namespace terrace::python
