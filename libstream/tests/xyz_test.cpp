// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <limits>
#include <random>
#include <string>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "point_files.hpp"
#include "terrace/stream/point_writer.hpp"

namespace terrace::stream {
namespace {

class Xyz : public ::testing::Test {
 protected:
  AllPoints read(std::string_view text, const SourceOptions& options = {.format = "xyz"}) {
    return read_file(write_text(folder_.path() / "points.xyz", text), options);
  }
  std::string refusal(std::string_view text) {
    return error_of([&] { read(text); });
  }

  TempFolder folder_;
};

TEST_F(Xyz, LargeIntegersAreKeptOrRefused) {
  const AllPoints all = read(
      "x,y,z,id,hash,time\n1,2,3,-9007199254740993,18446744073709551615,5\n"
      "4,5,6,\"+1\",0,0.5\n");
  ASSERT_EQ(all.info.attributes.size(), 3u);
  EXPECT_EQ(all.info.attributes[0].type, ScalarType::i64);
  EXPECT_EQ(all.info.attributes[1].type, ScalarType::u64);
  EXPECT_EQ(all.info.attributes[2].type, ScalarType::f64);
  std::int64_t ids[2];
  std::uint64_t hash = 0;
  std::memcpy(&ids[0], all.points.payload.data(), 8);
  std::memcpy(&hash, all.points.payload.data() + 8, 8);
  std::memcpy(&ids[1], all.points.payload.data() + 24, 8);
  EXPECT_EQ(ids[0], -9007199254740993);
  EXPECT_EQ(hash, 18446744073709551615u);
  EXPECT_EQ(ids[1], 1);

  // Reals without a fraction may be rounded like other reals.
  EXPECT_EQ(refusal("1 2 3 0.5\n1 2 3 9007199254740993\n"), "");
  EXPECT_EQ(refusal("1 2 3 9007199254740993\n1 2 3 0.5\n"), "");
  std::string late;
  for (int i = 0; i < 20'000; ++i) late += "1 2 3 4\n";
  EXPECT_EQ(refusal(late + "1 2 3 9007199254740992\n"), "");
  EXPECT_NE(refusal(late + "1 2 3 9007199254740993\n")
                .find("line 20001: column 4, '9007199254740993', is an integer that a double"),
            std::string::npos);
  EXPECT_NE(refusal("1 2 3 9007199254740993\n" + late + "1 2 3 0.5\n")
                .find("'0.5', is not an integer of type int64, like the lines before it"),
            std::string::npos);
  std::string csv = "1,2,3,9007199254740993\n";
  for (int i = 0; i < 1000; ++i) csv += "1,2,3,4\n";
  EXPECT_NE(refusal(csv + "1,2,3,\n")
                .find("line 1002: column 4 is empty, not an integer of type int64, like "
                      "the lines before it; correct it, or leave the column out"),
            std::string::npos);
}

TEST_F(Xyz, IgnoresSeparatorsInQuotedNames) {
  const AllPoints all = read("x,y,z,\"a;b\",\"c,d\"\n1,2,3,4,5\n");
  ASSERT_EQ(all.info.attributes.size(), 2u);
  EXPECT_EQ(all.info.attributes[0].name, "a;b");
  EXPECT_EQ(all.info.attributes[1].name, "c,d");
}

TEST_F(Xyz, ReadsEverySeparatorLineEndAndComment) {
  const std::vector<Point3> expected{{1, 2, 3}, {4.5, -5, 6e3}};
  for (const std::string_view text : {
           "1 2 3\n4.5 -5 6e3\n",
           "1 2 3\n4.5 -5 6e3",
           "x,y,z\r1,2,3\r4.5,-5,6e3\r",
           "1\t2\t3\r\n4.5\t-5\t6e3\r\n",
           "1,2,3\n4.5,-5,6e3\n",
           "1, 2 ,3\n 4.5 , -5,\t6e3 \n",
           "1;2;3\n4.5;-5;6e3\n",
           "  1   2 \t 3  \n\n\n4.5 -5 +6000.00\n\n",
           "# a comment\n// another\n1 2 3\n  # between\n4.5 -5 6e3\n// end",
           "x y z\n1 2 3\n4.5 -5 6e3\n",
           "X,Y,Z\n1,2,3\n4.5,-5,6e3\n",
           "\"x\",\"y\",\"z\"\n1,2,3\n4.5,-5,6e3\n",
           "z,x,y\n3,1,2\n6e3,4.5,-5\n",
           "Easting;Northing;Elevation\n1;2;3\n4.5;-5;6e3\n",
           "# East North Height\n1 2 3\n4.5 -5 6e3\n",
           "//X Y Z\n1 2 3\n4.5 -5 6e3\n",
           "\"x\",\"y\",\"z\"\n\"1\",\"2\",\"3\"\n\"4.5\", \"-5\" ,'6e3'\n",
           "\xEF\xBB\xBFx,y,z\n1,2,3\n4.5,-5,6e3\n",
           "\xEF\xBB\xBF"
           "1,2,3\n4.5,-5,6e3\n",
       }) {
    SCOPED_TRACE(text);
    const AllPoints all = read(text);
    EXPECT_TRUE(same_bits(all.points.positions, expected));
    EXPECT_TRUE(all.info.attributes.empty());
    EXPECT_FALSE(all.info.crs.geographic);
    EXPECT_TRUE(same_bits(read(text, {}).points.positions, expected))
        << "format determined from content";
  }
}

TEST_F(Xyz, NamesCoordinatesAndAttributesByTheHeader) {
  const AllPoints all = read("id,lat,lon,height,class,class\n7,47,8,500,2,3\n8,48,9,600,6,nan\n");
  EXPECT_TRUE(same_bits(all.points.positions, std::vector<Point3>{{8, 47, 500}, {9, 48, 600}}));
  EXPECT_TRUE(all.info.crs.geographic);
  ASSERT_EQ(all.info.attributes.size(), 3u);
  EXPECT_EQ(all.info.attributes[0].name, "id");
  EXPECT_EQ(all.info.attributes[1].name, "class");
  EXPECT_EQ(all.info.attributes[2].name, "class_2");
  EXPECT_EQ(all.values<double>(0)[1], 8.0);
  EXPECT_EQ(all.values<double>(1)[0], 2.0);
  EXPECT_TRUE(std::isnan(all.values<double>(2)[1]));
}

TEST_F(Xyz, LettersTakePrecedenceOverWords) {
  const AllPoints all = read("lat,lon,x,y,z,height\n47,8,1,2,3,4\n");
  EXPECT_TRUE(same_bits(all.points.positions, std::vector<Point3>{{1, 2, 3}}));
  EXPECT_FALSE(all.info.crs.geographic);
  ASSERT_EQ(all.info.attributes.size(), 3u);
  EXPECT_EQ(all.info.attributes[2].name, "height");
}

TEST_F(Xyz, FindsDecoratedNamesOfCoordinatesAfterOtherColumns) {
  for (const std::string_view header :
       {"FID,POINT_X,POINT_Y,POINT_Z", "id,x_coord,y_coord,z_coord", "id,X [m],Y [m],Z [m]",
        "PointID,Easting(m),Northing(m),Elev(m)", "id,E,N,H", "n_id,XCoord,YCoord,Height_ft",
        "id,UTM_X,UTM_Y,z", "id,Rechtswert,Hochwert,H\xC3\xB6he", "//id,pos.x,pos.y,pos.z",
        "# id,east,north,alt"}) {
    SCOPED_TRACE(header);
    const AllPoints all = read(std::string(header) + "\n7,1,2,3\n8,4,5,6\n");
    EXPECT_TRUE(same_bits(all.points.positions, std::vector<Point3>{{1, 2, 3}, {4, 5, 6}}));
    ASSERT_EQ(all.info.attributes.size(), 1u);
    EXPECT_EQ(all.values<double>(0)[1], 8.0);
  }
  EXPECT_TRUE(read("id,lon_deg,lat_deg,h\n7,1,2,3\n").info.crs.geographic);
}

TEST_F(Xyz, RejectsAHeaderWithoutCoordinates) {
  for (const std::string_view header :
       {"id,first,second,third", "id,nx,ny,nz", "id,x_std,y_std,z_std", "point,x2,y2,z2"}) {
    EXPECT_NE(refusal(std::string(header) + "\n7,1,2,3\n").find("the header names no x column"),
              std::string::npos)
        << header;
  }
}

TEST_F(Xyz, MakesDuplicateColumnNamesDistinct) {
  const AllPoints all = read("x,y,z,a,a_2,a,a\n1,2,3,4,5,6,7\n");
  ASSERT_EQ(all.info.attributes.size(), 4u);
  EXPECT_EQ(all.info.attributes[2].name, "a_3");
  EXPECT_EQ(all.info.attributes[3].name, "a_4");
}

TEST_F(Xyz, NumbersUnnamedColumns) {
  const AllPoints all = read("1 2 3 4 5\n6 7 8 9 10\n");
  ASSERT_EQ(all.info.attributes.size(), 2u);
  EXPECT_EQ(all.info.attributes[0].name, "a3");
  EXPECT_EQ(all.info.attributes[1].name, "a4");
  EXPECT_EQ(all.values<double>(1)[1], 10.0);
}

TEST_F(Xyz, RefusesBadTextWithItsLine) {
  const struct {
    std::string_view text, message;
  } cases[] = {
      {"", "the file is empty"},
      {"\n\n", "it has no points"},
      {"# nothing\n", "it has no points"},
      {"x y z\n", "it has no points"},
      {"1 2 3\n1 2\n", "line 2: has 2 columns, but the previous lines have 3"},
      {"1 2 3\n1 2 3 4\n", "line 2: has 4 columns"},
      {"1,2,3\n1,2,3,\n", "line 2: has 4 columns"},
      {"1,2,3,\n1,2,3,9007199254740993\n", "line 2: column 4, '9007199254740993', is an integer"},
      {"1,2,3,4\n1,2,3,none\n",
       "line 2: column 4, 'none', is not a number that fits into a double"},
      {"x\ty\tz\tv\n1\t2\t3\n", "line 2: has 3 columns, but the header in line 1 names 4"},
      {"1\t2\t3\t4\n1\t\t4\n", "line 2: has 3 columns, but the previous lines have 4"},
      {"1,2,3\n1,null,3\n", "line 2: column 2, 'null'"},
      {"1,2,3\n1,-,3\n", "line 2: column 2, '-'"},
      {"1,2,3\n,inf,3\n", "line 2: column 2 is inf"},
      {"1 2 3\n\n# c\n1 nan inf\n", "line 4: column 3 is inf"},
      {"1 2 3\n1 -inf 3\n", "line 2: column 2 is -inf"},
      {"1 2 1e999\n", "line 1: column 3, '1e999'"},
      {"1 2 3\n1 2 abc\n", "line 2: column 3, 'abc'"},
      {"1 2 3\n1 2 3x\n", "line 2: column 3, '3x'"},
      {"1 2 3\n1 2 --3\n", "line 2: column 3, '--3'"},
      {"1 2 3\n1 2 +-3\n", "line 2: column 3, '+-3'"},
      {"1 2 3\n1 2 0x10\n", "line 2: column 3, '0x10'"},
      {"1 2\n", "line 1: has 2 columns, but a point needs x, y and z; add"},
      {"5\n1 2 3\n", "line 1: has 1 column,"},
      {"x,y\n1,2\n", "has 2 columns"},
      {"x,y,value\n1,2,3\n", "line 1: the header names no z column"},
      {"x,x,y,z\n1,2,3,4\n", "line 1: columns 'x' and 'x' name the same coordinate"},
      {"x,y,z\n1,2,3,4\n", "line 2: has 4 columns, but the header in line 1 names 3"},
      {"x,y,z\nabc,y,z\n1,2,3\n", "line 2: column 1, 'abc'"},
      {"1,5;2,5;3,5\n",
       "column 1, '1,5', is not a number that fits into a double; write numbers with"},
      {"x,y,z,\"a, b\"\n1,2,3,\"c, d\"\n", "line 2: column 4, '\"c, d\"'"},
      {std::string_view("1 2 3\n1 2 \0003\n", 13), "line 2: column 3"},
  };
  for (const auto& [text, message] : cases) {
    SCOPED_TRACE(text);
    const std::string error = refusal(text);
    EXPECT_NE(error.find(message), std::string::npos) << error;
    EXPECT_NE(error.find("points.xyz"), std::string::npos) << error;
  }
}

TEST_F(Xyz, SkipsAndCountsPointsWithNaN) {
  for (const std::string_view text : {"x,y,z,v\nnan,1,2,5\n3,4,5,6\n7,8,NaN,\"7\"\n7,nan,9,8\n",
                                      "1 2 NAN 3\nnan nan nan nan\n3 4 5 6\n1 -nan 3 1\n",
                                      "x,y,z,v\n1,,2,5\n3,4,5,6\n\"\",NA,2,7\n1,2, ,8\n",
                                      "1;;2;5\n3;4;5;6\nNA;8;9;7\n1;2;\"NA\";1\n"}) {
    const std::string file = write_text(folder_.path() / "holes.xyz", text);
    const auto source = open_source(std::array{file}, {.block_points = 1});
    const AllPoints all = read_all(*source);
    EXPECT_EQ(all.points.positions, (std::vector<Point3>{{3, 4, 5}}));
    EXPECT_EQ(all.values<double>(0)[0], 6.0);
    EXPECT_EQ(source->progress().nodata, 3u);
  }
}

TEST_F(Xyz, EmptyAttributesAreNaNAndCounted) {
  for (const std::string_view text : {
           "x,y,z,v,w\n1,2,3,,5\n,2,3,,5\n4,5,6,7,\n7,8,9,NA,\"\"\n",
           "1;2;3;;5\nNA;2;3;4;5\n4;5;6;7;\n7;8;9; ;\"NA\"\n",
           "x\ty\tz\tv\tw\n1\t2\t3\t\t5\n\t2\t3\t\t5\n4\t5\t6\t7\t\n7\t8\t9\t\t\n",
           "1\t2\t3\t-1\t5\n1\t\t\t\t\n1\t2\t3\t\t5\n4\t5\t6\t7\t\n7\t8\t9\t\t\n",
           "#x\ty\tz\tv\tw\n1\t2\t3\t\t5\n1\t2\tNA\t\t5\n4\t5\t6\t7\t\n7\t8\t9\tNA\t\n",
       }) {
    SCOPED_TRACE(text);
    const std::string file = write_text(folder_.path() / "empty.csv", text);
    const auto source = open_source(std::array{file, file}, {.block_points = 2});
    const AllPoints all = read_all(*source);
    const std::size_t complete = text[6] == '-' ? 1 : 0, points = 3 + complete;
    ASSERT_EQ(all.points.size(), 2 * points);
    EXPECT_EQ(source->progress().nodata, 2u);
    EXPECT_EQ(source->progress().empty_values, 8u);
    const auto v = all.values<double>(0), w = all.values<double>(1);
    for (const std::size_t first : {complete, points + complete}) {
      EXPECT_EQ(all.points.positions[first + 2], (Point3{7, 8, 9}));
      EXPECT_TRUE(std::isnan(v[first]) && std::isnan(v[first + 2]));
      EXPECT_TRUE(std::isnan(w[first + 1]) && std::isnan(w[first + 2]));
      EXPECT_EQ(v[first + 1], 7.0);
      EXPECT_EQ(w[first], 5.0);
    }
  }
}

TEST_F(Xyz, TabsSeparateFieldsWithBlanksAndAlignTables) {
  // A missing name (an index), a name with blanks, and a text that is not needed.
  AllPoints all = read("\tx\ty\tz\tpoint id\n0\t1\t2\t3\t5\n1\t4\t5\t6\t\n");
  ASSERT_EQ(all.info.attributes.size(), 2u);
  EXPECT_EQ(all.info.attributes[0].name, "a0");
  EXPECT_EQ(all.info.attributes[1].name, "point id");
  EXPECT_EQ(all.points.positions[1], (Point3{4, 5, 6}));
  all = read("x\ty\tz\tplace\tv\n1\t2\t3\tNew York\t8\n4\t5\t6\t7 8\t\n",
             {.format = "xyz", .selection = {.drop = {"place"}}});
  EXPECT_EQ(all.points.positions, (std::vector<Point3>{{1, 2, 3}, {4, 5, 6}}));
  EXPECT_TRUE(std::isnan(all.values<double>(0)[1]));
  // Runs of blanks and tabs remain one separator where they align columns.
  for (const std::string_view text :
       {"x\t\ty\tz\n1\t\t2\t3\n", "1\t\t2\t\t3\n", "\t1\t2\t3\n", "1\t2\t3\t\t\n", "1\t 2 \t3\n",
        "x y z\n1\t2\t3\n", "x\ty\tz\n1 2\t3\n", "x\ty\tz\n1\t\t2\t3\n"}) {
    SCOPED_TRACE(text);
    all = read(std::string(text) + "400\t5\t6\n4\t\t5\t6\n");
    EXPECT_TRUE(all.info.attributes.empty());
    EXPECT_EQ(all.points.positions, (std::vector<Point3>{{1, 2, 3}, {400, 5, 6}, {4, 5, 6}}));
  }
  all = read("x y z\tr\tg\tb\n1 2 3\t4\t5\t6\n");
  EXPECT_EQ(all.values<double>(2)[0], 6.0);
}

TEST_F(Xyz, ColumnsThatAreNotNeededMayContainAnything) {
  const std::string_view text =
      "x,y,z,v,\"place, name\"\n1,2,3,7,\"a \"\"b\"\", c\"\n4,5,6,8,\n7,8,9,9,2020-01-01T00:00\n";
  const std::string name = "place, name";
  SourceOptions options{.format = "xyz"};
  for (const Selection& selection :
       {Selection{.drop = {name}}, Selection{.keep = std::vector<std::string>{"v"}},
        Selection{.where = "v >= 7", .drop = {name}}}) {
    options.selection = selection;
    const AllPoints all = read(text, options);
    EXPECT_TRUE(
        same_bits(all.points.positions, std::vector<Point3>{{1, 2, 3}, {4, 5, 6}, {7, 8, 9}}));
    ASSERT_EQ(all.info.attributes.size(), 1u);
    EXPECT_EQ(all.values<double>(0)[2], 9.0);
  }
  // Columns that a condition names are needed.
  options.selection = {.where = "\"place, name\" > 0", .drop = {name}};
  EXPECT_NE(error_of([&] { read(text, options); }).find("line 2: column 5"), std::string::npos);
  options.selection = {.drop = {name}};
  EXPECT_NE(error_of([&] {
              read("x,y,z,\"place, name\"\n1,-,3,a\n1,2,3,b\n", options);
            }).find("line 2: column 2, '-'"),
            std::string::npos);
}

TEST_F(Xyz, RejectsDecimalCommasInPlainWords) {
  for (const char* text : {"1,5\t2,5\t3,5\n", "1,5\t2\t3\n", "1,5 2,5 3,5\n", "-1,5e3\t2,5\t+3,5\n",
                           "x\ty\tz\n1,5\t2,5\t3,5\n", "# points\n\"1,5\"\t\"2,5\"\t\"3,5\"\n",
                           "1,5;2,5;3,5\n", "1\t2\t3\n1,5\t2,5\t3,5\n"}) {
    EXPECT_NE(refusal(text).find("decimal point"), std::string::npos) << refusal(text);
  }
  EXPECT_EQ(read("1,5,2\n3,4,5\n").points.size(), 2u);
  EXPECT_EQ(read("1, 5, 2\n").points.size(), 1u);
  EXPECT_EQ(read("1,\t5,\t2\n").points.size(), 1u);
}

TEST_F(Xyz, RejectsEndlessLines) {
  const std::string error = refusal("1 2 3\n" + std::string(200000, '7'));
  EXPECT_NE(error.find("line 2: longer than 65536 bytes"), std::string::npos) << error;
  EXPECT_NE(refusal(std::string(1 << 20, ' ')).find("line 1: longer"), std::string::npos);
}

TEST_F(Xyz, RoundsTinyNumbersToZeroAndRejectsHugeOnes) {
  const AllPoints all = read("1e-999 -1e-400 0.000000001e-320\n4.9e-324 0e999 00012\n");
  EXPECT_TRUE(
      same_bits(all.points.positions, std::vector<Point3>{{0, -0.0, 0}, {4.9e-324, 0, 12}}));
  EXPECT_NE(refusal("1 2 " + std::string(400, '9')), "");
  const std::string tiny = "0." + std::string(400, '0') + "1";
  EXPECT_EQ(read("1 2 " + tiny).points.positions[0][2], 0.0);
}

TEST_F(Xyz, BlocksAreBoundedAndInFileOrder) {
  std::string text;
  for (int i = 0; i < 1000; ++i) text += std::to_string(i) + " 0 0 " + std::to_string(-i) + "\n";
  for (const std::size_t size : {1u, 7u, 1000u, 5000u}) {
    const AllPoints all = read(text, {.block_points = size});
    EXPECT_EQ(all.largest_block, std::min<std::size_t>(size, 1000));
    ASSERT_EQ(all.points.size(), 1000u);
    for (std::size_t i = 0; i < 1000; ++i) {
      EXPECT_EQ(all.points.positions[i][0], static_cast<double>(i));
      EXPECT_EQ(all.values<double>(0)[i], -static_cast<double>(i));
    }
  }
}

TEST_F(Xyz, ReportsProgress) {
  std::string text;
  for (int i = 0; i < 100000; ++i) text += "1 2 3\n";
  const std::vector<std::string> files{write_text(folder_.path() / "p.xyz", text)};
  const auto source = open_source(files);
  PointBlock block;
  double last = 0;
  std::uint64_t points = 0;
  while (source->next(block)) {
    points += block.size();
    const Progress progress = source->progress();
    EXPECT_EQ(progress.points, points);
    EXPECT_GE(progress.fraction, last);
    EXPECT_LE(progress.fraction, 1.0);
    last = progress.fraction;
  }
  EXPECT_EQ(last, 1.0);
}

/// Both text formats are read back bit for bit.
TEST_F(Xyz, WritesWhatItReadsBitForBit) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937_64 random(seed);
    const std::size_t count = random() % 200 + 1, columns = random() % 4;
    PointBlock block;
    PointHeader header;
    for (std::size_t i = 0; i < count; ++i) {
      block.positions.push_back({any_double(random), any_double(random), any_double(random)});
    }
    for (std::size_t c = 0; c < columns; ++c) {
      header.attributes.push_back({.name = "value " + std::to_string(c)});
    }
    for (std::size_t i = 0; i < count * columns; ++i) {
      append_values(block.payload, any_double(random));
    }
    for (const std::string name : {"out.xyz", "out.csv"}) {
      const auto path = folder_.path() / name;
      const auto writer = open_point_writer(path, header, {.replace = true});
      writer->append(block);
      EXPECT_EQ(writer->points(), count);
      writer->finish();
      const AllPoints all = read_file(path);
      EXPECT_TRUE(same_bits(all.points.positions, block.positions));
      EXPECT_EQ(all.points.payload, block.payload);
      ASSERT_EQ(all.info.attributes.size(), columns);
      for (std::size_t c = 0; c < columns; ++c) {
        if (name == "out.csv") {
          EXPECT_EQ(all.info.attributes[c].name, "value_" + std::to_string(c));
        }
      }
    }
  }
}

// Every step of a lattice is written with its decimals, however the sum was rounded.
TEST_F(Xyz, WritesTheDecimalsOfALattice) {
  std::mt19937_64 random(41);
  for (const auto& [scale, offset, decimals] :
       std::vector<std::tuple<double, double, int>>{{0.01, 0.0, 2},
                                                    {0.001, 500000.0, 3},
                                                    {0.01, -0.125, 3},
                                                    {1e-7, 180.0, 7},
                                                    {0.25, 1e6, 2}}) {
    SCOPED_TRACE(std::to_string(scale) + ", " + std::to_string(offset));
    const std::string path = (folder_.path() / "lattice.xyz").string();
    const auto writer = open_point_writer(
        path, {.lattice = Lattice{{scale, scale, scale}, {offset, offset, offset}}},
        {.format = "xyz", .replace = true});
    PointBlock block;
    std::vector<std::int64_t> steps;
    for (int i = 0; i < 900; ++i) {
      steps.push_back(static_cast<std::int32_t>(random()) >> (random() % 20));
      const double value = static_cast<double>(steps.back()) * scale + offset;
      if (i % 3 == 0) block.positions.emplace_back();
      block.positions.back()[static_cast<std::size_t>(i) % 3] = value;
    }
    writer->append(block);
    writer->finish();
    std::ifstream file(path);
    std::string word;
    for (const std::int64_t step : steps) {
      ASSERT_TRUE(file >> word);
      const std::size_t dot = word.find('.');
      if (dot != std::string::npos && word.find('e') == std::string::npos) {
        EXPECT_LE(word.size() - dot - 1, static_cast<std::size_t>(decimals)) << word;
      }
      EXPECT_EQ(std::llround((std::stod(word) - offset) / scale), step) << word;
    }
  }
}

// Values without a decimal lattice, or off its steps, keep every bit.
TEST_F(Xyz, WritesCoordinatesOffTheLatticeBitForBit) {
  std::mt19937_64 random(42);
  for (const double scale : {1.0 / 3600, 0.01}) {
    const std::string path = (folder_.path() / "free.xyz").string();
    const auto writer = open_point_writer(path, {.lattice = Lattice{{scale, scale, scale}, {}}},
                                          {.format = "xyz", .replace = true});
    PointBlock block;
    for (int i = 0; i < 300; ++i) {
      const auto off = [&] { return (static_cast<double>(random() % 100000) + 0.3) * scale; };
      block.positions.push_back({off(), off(), off()});
    }
    writer->append(block);
    writer->finish();
    EXPECT_EQ(read_file(path).points.positions, block.positions);
  }
}

TEST_F(Xyz, WritesTypedColumnsInShortestFormAndScaledOnesAsRealValues) {
  const PointHeader header{
      .attributes = {{.name = "n", .type = ScalarType::i64},
                     {.name = "f", .type = ScalarType::f32},
                     {.name = "s", .type = ScalarType::u16, .scale = 0.5, .offset = 10},
                     {.name = "Z", .type = ScalarType::u8},
                     {.name = "a,b", .type = ScalarType::u8}}};
  PointBlock block;
  block.positions = {{0.1, -2, 1e300}};
  append_values(block.payload, std::int64_t{-9007199254740993}, 0.1f, std::uint16_t{65535},
                std::uint8_t{200}, std::uint8_t{7});
  const auto path = folder_.path() / "typed.csv";
  const auto writer = open_point_writer(path, header);
  writer->append(block);
  EXPECT_FALSE(std::filesystem::exists(path));
  writer->finish();
  EXPECT_EQ(read_text(path),
            "x,y,z,n,f,s,Z_2,\"a_b\"\n0.1,-2,1e+300,-9007199254740993,0.1,32777.5,200,7\n");
  EXPECT_NE(error_of([&] { open_point_writer(path, header); }), "") << "it exists";
}

}  // namespace
}  // namespace terrace::stream
