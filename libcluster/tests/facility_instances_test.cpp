// SPDX-License-Identifier: Apache-2.0
// Solves the instances of OR-Library, UflLib and Kratica, whose optima are known.
#include "facility_instances.hpp"

#include <gtest/gtest.h>

#include "matrix_laws.hpp"
#include "terrace/cluster/facility_location.hpp"
#include "terrace/cluster/k_median.hpp"

namespace terrace::cluster {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSlow = true;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
constexpr bool kSlow = true;
#else
constexpr bool kSlow = false;
#endif
#else
constexpr bool kSlow = false;
#endif

// Optima are given with three decimals.
constexpr double kDigits = 1e-6;

TEST(FacilityInstances, CostsAreNearTheKnownOptima) {
  const auto folder = instances::folder();
  if (!folder) GTEST_SKIP() << "TERRACE_DATA names no folder with facility/optima.tsv";
  double sum = 0.0;
  unsigned count = 0, seen = 0;
  for (instances::Instance& instance : instances::listed(*folder)) {
    if (instance.format == "pmed") continue;
    ++seen;
    if (kSlow && instance.facilities * instance.clients > 12000) continue;
    SCOPED_TRACE(instance.file);
    instances::load(*folder, instance);
    const FacilityMatrix matrix = instance.matrix();
    const FacilitySolution found = solve(matrix, {.restarts = 2, .steps = 60, .threads = 2});
    laws::expect_solution(matrix, found);
    const LowerBound bound = lower_bound(matrix, found);
    EXPECT_LE(bound.lower_bound, instance.optimum * (1.0 + kDigits));
    EXPECT_LE(bound.lower_bound, found.cost());
    EXPECT_LE(lower_bound(matrix, {}, {.steps = 0}).lower_bound, bound.lower_bound);
    if (instance.proved) {
      EXPECT_GE(found.cost(), instance.optimum * (1.0 - kDigits));
    }
    for (const FacilityStrategy strategy :
         {FacilityStrategy::jain_vazirani, FacilityStrategy::greedy_stars}) {
      FacilityReport report;
      const FacilitySolution grown = solve(matrix, {.strategy = strategy}, &report);
      laws::expect_solution(matrix, grown);
      EXPECT_LE(grown.lower_bound, instance.optimum * (1.0 + kDigits));
      EXPECT_GE(grown.cost(), found.cost() * (1.0 - kDigits));
      if (instance.is_metric()) {
        EXPECT_LE(grown.cost(), 3.0 * grown.lower_bound);
        EXPECT_LE(report.divisor, 1.861);
      }
    }
    const double above = found.cost() / instance.optimum - 1.0;
    if (instance.is_metric()) {
      EXPECT_LE(above, 0.02);
    }
    // In these groups good solutions are isolated by design, so no local search finds them.
    const std::string group = instance.group();
    if (group == "GapA" || group == "GapB" || group == "Chess" || group == "Fpp11") continue;
    sum += above;
    ++count;
  }
  EXPECT_EQ(seen, 75u);
  EXPECT_LE(sum / count, 0.005);
}

TEST(FacilityInstances, MediansAreNearTheKnownOptima) {
  const auto folder = instances::folder();
  if (!folder) GTEST_SKIP() << "TERRACE_DATA names no folder with facility/optima.tsv";
  unsigned seen = 0;
  for (instances::Instance& instance : instances::listed(*folder)) {
    if (instance.format != "pmed") continue;
    ++seen;
    if (kSlow && instance.facilities > 100) continue;
    SCOPED_TRACE(instance.file);
    instances::load(*folder, instance);
    const FacilityMatrix matrix = instance.matrix();
    const FacilitySolution found = k_median(matrix, instance.medians, {.threads = 2});
    laws::expect_solution(matrix, found, false);
    EXPECT_EQ(found.facilities.size(), instance.medians);
    EXPECT_LE(found.cost(), instance.optimum * 1.02);
    EXPECT_GE(found.cost(), instance.optimum);
    EXPECT_LE(found.lower_bound, instance.optimum);
    EXPECT_GE(found.lower_bound, 0.95 * instance.optimum);
  }
  EXPECT_EQ(seen, 14u);
}

TEST(FacilityInstances, ReaderRejectsInvalidInstances) {
  const auto read = [](const std::string& format, const std::string& text) {
    instances::Instance instance;
    instance.format = format;
    instances::parse(instances::Words("text", text), instance);
    return instance;
  };
  const instances::Instance small = read("orlib", "2 1\ncapacity 5.\n0 6.\n3 1.5 2.5\n");
  EXPECT_EQ(small.opening, (std::vector{5.0, 6.0}));
  EXPECT_EQ(small.connection, (std::vector{1.5, 2.5}));
  EXPECT_EQ(read("simple", "FILE: x\n2 2 0\n1 5 1 2\n2 6 3 4\n").connection,
            (std::vector{1.0, 2.0, 3.0, 4.0}));
  // The last of repeated edges counts, and paths may be shorter than edges.
  EXPECT_EQ(read("pmed", "3 4 1\n1 2 9\n2 3 1\n1 3 8\n2 1 2\n").connection,
            (std::vector{0.0, 2.0, 3.0, 2.0, 0.0, 1.0, 3.0, 1.0, 0.0}));
  for (const auto& [format, text] : std::vector<std::pair<std::string, std::string>>{
           {"orlib", ""},
           {"orlib", "2 1\n0 5\n0 6\n3 1.5\n"},
           {"orlib", "2 1\n0 5\n0 6\n3 1.5 2.5 7\n"},
           {"orlib", "2 1\n0 5\n0 x\n3 1.5 2.5\n"},
           {"orlib", "2 1\n0 5\n0 -6\n3 1.5 2.5\n"},
           {"orlib", "0 1\n3\n"},
           {"orlib", "1.5 1\n0 5\n3 1\n"},
           {"simple", "2 2 0\n1 5 1 2\n2 6 3 4\n"},
           {"simple", "FILE: x\n2 2 1\n1 5 1 2\n2 6 3 4\n"},
           {"simple", "FILE: x\n2 2 0\n1 5 1 2\n3 6 3 4\n"},
           {"simple", "FILE: x\n2 2 0\n1 5 1 nan\n2 6 3 4\n"},
           {"pmed", "3 1 1\n1 2 9\n"},
           {"pmed", "3 2 4\n1 2 9\n2 3 1\n"},
           {"pmed", "3 2 1\n1 4 9\n2 3 1\n"},
           {"other", "1 1"},
       }) {
    SCOPED_TRACE(format + ": " + text);
    EXPECT_THROW(read(format, text), std::invalid_argument);
  }
}

}  // namespace
}  // namespace terrace::cluster
