// SPDX-License-Identifier: GPL-3.0-or-later
// What PROJ's own tests and IOGP's GIGS expect of the projections and shifts that are ours, each
// with the file's tolerance. What is not ours is counted and listed.
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <map>
#include <string>

#include <gtest/gtest.h>

#include "gie_file.hpp"
#include "gie_operation.hpp"

namespace terrace::terrain::gie {
namespace {

struct Tally {
  std::size_t run = 0, refused = 0, left = 0;
  std::map<std::string, std::size_t> unknown;  ///< cases by what is not ours
};

void check(const GieRun& run, const GieCase& one) {
  const Point2 start{one.accept.at(0), one.accept.at(1)};
  Point2 place = start;
  if (one.round_trips > 0) {
    for (int i = 0; i < one.round_trips; ++i) {
      place = run.apply(run.apply(place, one.inverse), !one.inverse);
    }
    if (std::isnan(start[0])) {
      EXPECT_TRUE(std::isnan(place[0]) && std::isnan(place[1]));
      return;
    }
    EXPECT_LE(run.distance(place, start, !one.inverse), one.tolerance);
    return;
  }
  place = run.apply(place, one.inverse);
  if (one.failure || std::isnan(one.expect.at(0))) {
    EXPECT_TRUE(std::isnan(place[0]) && std::isnan(place[1])) << place[0] << ' ' << place[1];
    return;
  }
  const Point2 expected{one.expect.at(0), one.expect.at(1)};
  // Beyond the transverse pole both y of the equator are one place.
  if (start[1] == 0 && std::abs(start[0]) > 90 && !one.inverse) place[1] = std::abs(place[1]);
  EXPECT_LE(run.distance(place, expected, one.inverse), one.tolerance)
      << place[0] << ' ' << place[1] << " in place of " << expected[0] << ' ' << expected[1];
}

Tally run_file(const std::string& path) {
  Tally tally;
  const auto operations = read_gie(path);
  if (!operations) {
    ADD_FAILURE() << path << " cannot be read";
    return tally;
  }
  for (const GieOperation& operation : *operations) {
    SCOPED_TRACE(path + ':' + std::to_string(operation.line) + ": " + operation.text);
    std::string unknown;
    std::optional<GieRun> run;
    try {
      run = GieRun::make(operation.text, unknown);
    } catch (const CrsError&) {
      EXPECT_TRUE(operation.refused);
      tally.refused += operation.refused ? 1 : 0;
      continue;
    }
    if (!run) {
      tally.unknown[unknown] += operation.cases.size() + (operation.refused ? 1 : 0);
      continue;
    }
    if (operation.refused) {
      ADD_FAILURE() << "accepted";
      continue;
    }
    for (const GieCase& one : operation.cases) {
      SCOPED_TRACE("line " + std::to_string(one.line));
      check(*run, one);
      ++tally.run;
    }
  }
  return tally;
}

class Gie : public ::testing::TestWithParam<std::pair<const char*, std::size_t>> {};

TEST_P(Gie, OursGiveWhatIsExpected) {
  const char* const data = std::getenv("TERRACE_DATA");
  if (data == nullptr) GTEST_SKIP() << "TERRACE_DATA is not set";
  const auto [name, least] = GetParam();
  const Tally tally = run_file(std::string(data) + "/geodesy/proj/" + name);
  std::size_t unknown = 0;
  for (const auto& [what, cases] : tally.unknown) unknown += cases;
  std::cout << name << ": " << tally.run << " cases run, " << tally.refused
            << " operations refused as expected, " << unknown << " cases not ours\n";
  for (const auto& [what, cases] : tally.unknown) {
    std::cout << "  not ours: " << what << " (" << cases << " cases)\n";
  }
  EXPECT_GE(tally.run, least) << "fewer than there were";
}

INSTANTIATE_TEST_SUITE_P(
    Files, Gie,
    ::testing::Values(std::pair{"5101.1-jhs.gie", 177}, std::pair{"5101.2-jhs.gie", 69},
                      std::pair{"5101.3-jhs.gie", 69}, std::pair{"5101.4-jhs-etmerc.gie", 69},
                      std::pair{"5102.2.gie", 57}, std::pair{"5201.gie", 0},
                      std::pair{"builtins.gie", 332}, std::pair{"more_builtins.gie", 26},
                      std::pair{"4D-API_cs2cs-style.gie", 10}, std::pair{"ellipsoid.gie", 10}));

}  // namespace
}  // namespace terrace::terrain::gie
