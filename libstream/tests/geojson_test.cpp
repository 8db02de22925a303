// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <limits>
#include <random>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "temp_folder.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/source.hpp"

namespace terrace::stream {
namespace {

using Json = nlohmann::ordered_json;

/// The contents of GeoJSON, found by walking the parsed document.
struct Walked {
  std::vector<Point3> positions;
  std::vector<std::vector<Point3>> lines;
  std::uint64_t single = 0;  ///< positions outside lines
};

Point3 position_of(const Json& json) {
  return {json[0].get<double>(), json[1].get<double>(),
          json.size() > 2 ? json[2].get<double>() : 0};
}

void walk(const Json& json, Walked& walked) {
  if (json.is_null()) return;
  const std::string type = json["type"];
  for (const char* const list : {"features", "geometries"}) {
    if (!json.contains(list)) continue;
    for (const Json& part : json[list]) walk(part, walked);
  }
  if (json.contains("geometry")) walk(json["geometry"], walked);
  if (!json.contains("coordinates")) return;
  const Json& coordinates = json["coordinates"];
  const auto points = [&](const Json& list) {
    for (const Json& position : list) walked.positions.push_back(position_of(position));
    walked.single += list.size();
  };
  const auto line = [&](const Json& list) {
    if (list.empty()) return;
    walked.lines.emplace_back();
    for (const Json& position : list) walked.lines.back().push_back(position_of(position));
    walked.positions.insert(walked.positions.end(), walked.lines.back().begin(),
                            walked.lines.back().end());
  };
  const auto each = [](const Json& list, const auto& what) {
    for (const Json& part : list) what(part);
  };
  if (type == "Point" && !coordinates.empty()) points(Json::array({coordinates}));
  if (type == "MultiPoint") points(coordinates);
  if (type == "LineString") line(coordinates);
  if (type == "MultiLineString" || type == "Polygon") each(coordinates, line);
  if (type == "MultiPolygon") {
    each(coordinates, [&](const Json& polygon) { each(polygon, line); });
  }
}

bool same_bits(const std::vector<Point3>& a, const std::vector<Point3>& b) {
  using Bits = std::array<std::uint64_t, 3>;
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const Point3& p, const Point3& q) {
    return std::bit_cast<Bits>(p) == std::bit_cast<Bits>(q);
  });
}

class GeoJson : public ::testing::Test {
 protected:
  std::string put(const std::string& name, const std::string& content) {
    std::ofstream(folder_.path() / name, std::ios::binary) << content;
    return (folder_.path() / name).string();
  }

  static SourceOptions options(Entities entities, std::size_t block_points = 7) {
    SourceOptions options;
    options.entities = entities;
    options.block_points = block_points;
    return options;
  }

  static std::vector<Point3> points_of(const std::vector<std::string>& files) {
    const auto source = open_source(files, options(Entities::points));
    EXPECT_TRUE(source->info().attributes.empty());
    std::vector<Point3> points;
    for (PointBlock block; source->next(block);) {
      EXPECT_LE(block.size(), 7u);
      points.insert(points.end(), block.positions.begin(), block.positions.end());
    }
    return points;
  }

  /// Joins the lines again and checks the columns on the way.
  static std::vector<std::vector<Point3>> lines_of(const std::vector<std::string>& files,
                                                   Entities entities,
                                                   std::uint64_t* excluded = nullptr) {
    const auto source = open_source(files, options(entities));
    const SourceInfo& info = source->info();
    const std::size_t corners = entities == Entities::segments ? 2 : kPolylineVertices;
    const std::size_t numbers = 3 * (corners - 1);
    EXPECT_EQ(info.attributes.size(), numbers + 4);
    EXPECT_EQ(info.attributes[numbers].name, "line");
    EXPECT_EQ(info.attributes[numbers - 1].name, "z" + std::to_string(corners));
    std::vector<std::vector<Point3>> lines;
    std::uint64_t pieces = 0;
    for (PointBlock block; source->next(block);) {
      EXPECT_LE(block.size(), 7u);
      EXPECT_EQ(block.payload.size(), block.size() * info.payload_size());
      for (std::size_t i = 0; i < block.size(); ++i, ++pieces) {
        const auto line = info.view<std::uint32_t>(block.payload, numbers)[i];
        const auto part = info.view<std::uint32_t>(block.payload, numbers + 1)[i];
        const auto vertices = info.view<std::uint8_t>(block.payload, numbers + 2)[i];
        EXPECT_TRUE(vertices >= 2 && vertices <= corners);
        if (part == 0) {
          EXPECT_EQ(line, lines.size());
          lines.push_back({block.positions[i]});
        } else {
          EXPECT_EQ(line, lines.size() - 1);
          EXPECT_EQ(block.positions[i], lines.back().back());
        }
        for (std::size_t v = 0; v + 1 < corners; ++v) {
          Point3 corner{};
          for (std::size_t axis = 0; axis < 3; ++axis) {
            corner[axis] = info.view<double>(block.payload, 3 * v + axis)[i];
          }
          if (v + 1 < vertices) {
            lines.back().push_back(corner);
          } else {
            EXPECT_EQ(corner, Point3{});
          }
        }
      }
    }
    EXPECT_EQ(source->progress().points, pieces);
    if (excluded != nullptr) *excluded = source->progress().excluded;
    return lines;
  }

  static void expect_as_walked(const std::string& file, const Walked& expected) {
    EXPECT_TRUE(same_bits(points_of({file}), expected.positions));
    for (const Entities entities : {Entities::segments, Entities::polylines}) {
      std::uint64_t excluded = 0;
      const auto lines = lines_of({file}, entities, &excluded);
      EXPECT_EQ(excluded, expected.single);
      ASSERT_EQ(lines.size(), expected.lines.size());
      for (std::size_t i = 0; i < lines.size(); ++i) {
        EXPECT_TRUE(same_bits(lines[i], expected.lines[i])) << i;
      }
    }
  }

  void expect_error(const std::string& content, const std::string& expected,
                    Entities entities = Entities::segments) {
    const std::string file = put("bad.geojson", content);
    try {
      const auto source = open_source(std::vector{file}, options(entities));
      for (PointBlock block; source->next(block);) {
      }
      ADD_FAILURE() << "read: " << content.substr(0, 200);
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(expected), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find("byte"), std::string::npos) << error.what();
    }
  }

  TempFolder folder_;
};

/// Random geometries of all types, nested, with irrelevant members.
class Maker {
 public:
  explicit Maker(std::uint64_t seed) : random_(seed) {}

  Json feature() {
    Json feature{{"type", "Feature"},
                 {"properties",
                  {{"name", "a \"quoted\\\" } ] name \u00e9"},
                   {"coordinates", {1, {2, 3}}},
                   {"features", Json::array({Json::object()})},
                   {"type", "Point"}}}};
    feature["geometry"] = random_() % 9 == 0 ? Json() : geometry(0);
    if (random_() % 2 == 0) feature["bbox"] = {1, 2, 3, 4};
    return feature;
  }

  Json geometry(int depth) {
    constexpr std::array kGeometries{
        "Point",   "MultiPoint",   "LineString",        "MultiLineString",
        "Polygon", "MultiPolygon", "GeometryCollection"};
    const std::size_t type = random_() % (depth < 3 ? 7 : 6);
    Json geometry_json{{"type", kGeometries[type]}};
    if (type == 6) {
      geometry_json["geometries"] = Json::array();
      for (std::uint64_t i = random_() % 4; i > 0; --i)
        geometry_json["geometries"].push_back(geometry(depth + 1));
      return geometry_json;
    }
    geometry_json["coordinates"] = coordinates(std::array{1, 2, 2, 3, 3, 4}[type], type >= 2);
    if (random_() % 2 == 0) {  // members in another order
      Json reordered{{"coordinates", geometry_json["coordinates"]}, {"note", nullptr}};
      reordered["type"] = geometry_json["type"];
      return reordered;
    }
    return geometry_json;
  }

 private:
  Json coordinates(int depth, bool lines) {
    if (depth == 1) {
      Json position{number(), number()};
      if (random_() % 2 == 0) position.push_back(number());
      if (random_() % 9 == 0 && position.size() == 3) position.push_back(7);
      return position;
    }
    Json list = Json::array();
    std::uint64_t count = random_() % (depth == 2 ? 30 : 4);
    if (lines && depth == 2 && count == 1) count = 2;
    for (; count > 0; --count) list.push_back(coordinates(depth - 1, lines));
    return list;
  }

  Json number() {
    switch (random_() % 4) {
      case 0:
        return static_cast<int>(random_() % 360) - 180;
      case 1:
        return -0.0;
      default:
        return std::uniform_real_distribution(-180.0, 180.0)(random_);
    }
  }

  std::mt19937_64 random_;
};

TEST_F(GeoJson, MatchesAWalkOverTheDocument) {
  constexpr std::uint64_t kSeed = 20261123;
  std::cout << "seed " << kSeed << '\n';
  for (std::uint64_t round = 0; round < 60; ++round) {
    SCOPED_TRACE(round);
    Maker maker(kSeed + round);
    Json collection{{"type", "FeatureCollection"}, {"name", "x"}, {"features", Json::array()}};
    std::string lines, sequence;
    for (std::uint64_t i = round % 20; i > 0; --i) {
      collection["features"].push_back(maker.feature());
      lines += collection["features"].back().dump() + "\r\n";
      sequence += "\x1E" + collection["features"].back().dump(1) + "\n";
    }
    collection["after"] = {1, 2};
    Walked walked;
    walk(collection, walked);
    expect_as_walked(put("a.geojson", collection.dump(round % 2 == 0 ? -1 : 2)), walked);
    expect_as_walked(put("b.geojson", "\xEF\xBB\xBF" + collection.dump()), walked);
    if (lines.empty()) continue;
    expect_as_walked(put("c.geojsonl", lines), walked);
    expect_as_walked(put("d.geojsons", sequence), walked);

    Walked single;
    const Json geometry = maker.geometry(0);
    walk(geometry, single);
    expect_as_walked(put("e.geojson", geometry.dump()), single);
  }
}

TEST_F(GeoJson, PiecesJoinToTheWholeLine) {
  for (const int count : {2, 3, 4, 5, 7, 8, 1000}) {
    Json line{{"type", "LineString"}, {"coordinates", Json::array()}};
    for (int i = 0; i < count; ++i) line["coordinates"].push_back({i, i * i, 0.5});
    Walked walked;
    walk(line, walked);
    expect_as_walked(put("line.geojson", line.dump()), walked);
  }
}

TEST_F(GeoJson, NumbersLinesOfSeveralFilesConsecutively) {
  const std::string two =
      R"({"type":"MultiLineString","coordinates":[[[0,0],[1,1]],[[2,2],[3,3],[4,4]]]})";
  const std::vector<std::string> files{put("a.geojson", two), put("b.geojson", two),
                                       put("c.geojson", two)};
  for (const Entities entities : {Entities::segments, Entities::polylines}) {
    EXPECT_EQ(lines_of(files, entities).size(), 6u);
  }
  EXPECT_EQ(points_of(files).size(), 15u);
}

/// Returns the columns after those of the shape: names, and values row by row.
std::pair<std::vector<std::string>, std::vector<double>> properties_of(PointSource& source) {
  const SourceInfo& info = source.info();
  std::vector<std::string> names;
  std::vector<std::size_t> columns;
  for (std::size_t a = 0; a < info.attributes.size(); ++a) {
    if (is_shape_column(info.attributes[a].name, Entities::segments)) continue;
    EXPECT_EQ(info.attributes[a].type, ScalarType::f64);
    names.push_back(info.attributes[a].name);
    columns.push_back(a);
  }
  std::vector<double> values;
  for (PointBlock block; source.next(block);) {
    for (std::size_t i = 0; i < block.size(); ++i) {
      for (const std::size_t a : columns) values.push_back(info.view<double>(block.payload, a)[i]);
    }
  }
  return {names, values};
}

TEST_F(GeoJson, NumericPropertiesOfLinesAreColumns) {
  const std::string geometry =
      R"("geometry":{"type":"LineString","properties":{"no":1},"coordinates":[[0,0],[1,1],[2,2]]})";
  const auto feature = [&](const std::string& properties) {
    return R"({"type":"Feature","properties":)" + properties + "," + geometry + "}\n";
  };
  const std::string file = put(
      "a.geojsonl",
      feature(R"({"a":1,"text":"9","b":null,"c":[3],"d":{"e":4}})") +
          feature(R"({"b":-2.5,"a":7,"a":8})") + feature("null") + feature("[5,6]") +
          R"({"type":"Feature","properties":{"p":3},"geometry":{"type":"Point","coordinates":[1,1]}})" +
          "\n" + R"({"type":"LineString","properties":{"q":2},"coordinates":[[0,0],[1,1]]})");
  const auto source = open_source(std::vector{file}, options(Entities::segments));
  const auto [names, values] = properties_of(*source);
  EXPECT_EQ(names, (std::vector<std::string>{"a", "b"}));
  ASSERT_EQ(values.size(), 18u);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<double> expected{1,   nan, 1,   nan, 8,   -2.5, 8,   -2.5, nan,
                                     nan, nan, nan, nan, nan, nan,  nan, nan,  nan};
  for (std::size_t i = 0; i < 18; ++i) {
    EXPECT_TRUE(values[i] == expected[i] || (std::isnan(values[i]) && std::isnan(expected[i])))
        << i;
  }
  EXPECT_EQ(source->progress().empty_values, 1u + 0u + 3u * 2u);
  // Points have no properties.
  EXPECT_EQ(points_of({file}).size(), 15u);
}

TEST_F(GeoJson, RefusesTooManyProperties) {
  std::string properties = "{";
  for (int i = 0; i < 257; ++i) properties += (i > 0 ? ",\"p" : "\"p") + std::to_string(i) + "\":1";
  const std::string file = put("many.geojson", R"({"type":"Feature","properties":)" + properties +
                                                   R"(},"geometry":{"type":"LineString",)" +
                                                   R"("coordinates":[[0,0],[1,1]]}})");
  EXPECT_THROW(static_cast<void>(open_source(std::vector{file}, options(Entities::segments))),
               Error);
  EXPECT_EQ(points_of({file}).size(), 2u);
}

TEST_F(GeoJson, ReadsTheCrs) {
  const auto crs_of = [&](const std::string& member) {
    const std::string file =
        put("crs.geojson", "{" + member + R"("type":"FeatureCollection","features":[]})");
    return open_source(std::vector{file})->info().crs;
  };
  const auto named = [](const std::string& name) {
    return R"("crs":{"type":"name","properties":{"name":")" + name + R"("}},)";
  };
  EXPECT_EQ(crs_of("").epsg, 4326);
  EXPECT_TRUE(crs_of("").geographic);
  EXPECT_EQ(crs_of(named("urn:ogc:def:crs:OGC:1.3:CRS84")), crs_of(""));
  EXPECT_EQ(crs_of(named("EPSG:2056")).epsg, 2056);
  EXPECT_EQ(crs_of(named("urn:ogc:def:crs:EPSG::25832")).epsg, 25832);
  EXPECT_EQ(crs_of("\"crs\":null,"), Crs{});
  EXPECT_EQ(crs_of(named("EPSG:x")).epsg, 0);
  EXPECT_NE(crs_of(named("my own")).name.find("my own"), std::string::npos);

  const std::string late =
      R"({"type":"FeatureCollection","features":[],)" + named("EPSG:2056") + R"("a":1})";
  expect_error(late, "too late");
  SourceOptions source_options = options(Entities::points);
  source_options.crs.emplace().epsg = 3857;
  const auto source = open_source(std::vector{put("late.geojson", late)}, source_options);
  PointBlock block;
  EXPECT_FALSE(source->next(block));
  EXPECT_EQ(source->info().crs.epsg, 3857);
}

TEST_F(GeoJson, RejectsInvalidGeoJson) {
  const auto line = [](const std::string& coordinates) {
    return R"({"type":"LineString","coordinates":)" + coordinates + "}";
  };
  expect_error(line("[[0,0]]"), "has only one position");
  expect_error(line("[[0,0],[1]]"), "has only one number");
  expect_error(line("[[0,0],[]]"), "not those of a LineString");
  expect_error(line("[[[0,0],[1,1]]]"), "not those of a LineString");
  expect_error(line("[0,0]"), "not those of a LineString");
  expect_error(line("[[0,0],[1,1],[[2,2]]]"), "nested unevenly");
  expect_error(line("[[0,[0]],[1,1]]"), "among its numbers");
  expect_error(line("[[[0],0],[1,1]]"), "");
  expect_error(line("[[0,0],[1,\"1\"]]"), "a string");
  expect_error(line("[[0,0],[1,null]]"), "null");
  expect_error(line("[[0,0],[1,1e999]]"), "is not JSON");
  expect_error(line("[[0,0],[1,1]]").substr(0, 40), "ends within an object");
  expect_error(line("[[0,0],[1,1}]"), "is not JSON");
  expect_error(line("[[[[[[0,0]]]]]]"), "nested too deeply");
  expect_error(line("7"), "a number");
  expect_error(R"({"type":"LineString"})", "has no coordinates");
  expect_error(R"({"type":"Feature","geometry":{"type":"Arc","coordinates":[]}})",
               "the type 'Arc'");
  expect_error(R"({"type":"Feature","geometry":{"coordinates":[]}})", "has no type");
  expect_error(R"({"type":"Feature","geometry":5})", "a number");
  expect_error(R"({"type":"Point","features":[]})", "not a FeatureCollection");
  expect_error(R"({"type":"FeatureCollection","features":[{"type":"Feature","geometry":null}})",
               "comma");
  expect_error(R"({"type":"FeatureCollection","features":[,]})", "a feature is expected");
  expect_error(R"({"type":"FeatureCollection","features":[7]})", "a feature is expected");
  expect_error(R"({"type":"FeatureCollection","features":[],"features":[]})", "second list");
  expect_error(line("[[0,0],[1,1]]") + "x", "an object is expected");
  expect_error(
      R"({"type":"Feature","geometry":{"type":"LineString","coordinates":[],"coordinates":[]}})",
      "twice");
  std::string deep = R"("type":"Point","coordinates":[0,0])";
  for (int i = 0; i < 20; ++i) {
    deep = R"("type":"GeometryCollection","geometries":[{)" + deep + "}]";
  }
  expect_error(R"({"type":"Feature","geometry":{)" + deep + "}}", "nested too deeply");

  const std::string list(100'000, '['), end(100'000, ']');
  expect_error(R"({"type":"FeatureCollection","crs":)" + list + end + R"(,"features":[]})",
               "nested too deeply");

  // A feature longer than memory allows is refused before it is read completely.
  std::string large = R"({"type":"LineString","coordinates":[[0,0])";
  for (int i = 0; i < 400'000; ++i) large += ",[1,1]";
  SourceOptions little = options(Entities::polylines);
  little.memory_bytes = 1 << 20;
  const std::string file = put("large.geojson", large + "]}");
  try {
    const auto source = open_source(std::vector{file}, little);
    ADD_FAILURE() << "read";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("memory"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace terrace::stream
