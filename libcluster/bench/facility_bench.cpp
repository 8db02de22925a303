// SPDX-License-Identifier: Apache-2.0
// Compares the general facility location problem and k-median with known optima. Prints a table of
// every instance in TERRACE_DATA/facility (OR-Library, UflLib, Kratica), then mean and worst by
// group. Without the data, and with TERRACE_BENCH_SMALL, it solves synthetic instances and uses the
// best bound instead of the optimum. Columns, all in percent of the optimum except costs and
// seconds:
//   search   interchange with default options, one thread; k_median for p-median
//            instances, with their bound included in the seconds
//   JV, JMS  jain_vazirani and greedy_stars
//   bound    lower_bound from the search's solution
//   JV bnd, JMS bnd   the bounds of the two primal-dual algorithms
// At the end it prints lower bounds of points (BlockClusterer's solution for a fractal elevation
// model and its gap) and k-median of points.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>

#include "../tests/facility_instances.hpp"
#include "../tests/inputs.hpp"
#include "terrace/cluster/block.hpp"
#include "terrace/cluster/facility_location.hpp"
#include "terrace/cluster/k_median.hpp"

namespace {

using namespace terrace::cluster;

const bool kSmall = std::getenv("TERRACE_BENCH_SMALL") != nullptr;

double seconds_of(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

struct Row {
  double solution = 0.0, growth = 0.0, stars = 0.0;  // costs
  double bound = 0.0, growth_bound = 0.0, stars_bound = 0.0;
  double solution_seconds = 0.0, growth_seconds = 0.0, stars_seconds = 0.0, bound_seconds = 0.0;
};

Row measure(const instances::Instance& instance) {
  const FacilityMatrix matrix = instance.matrix();
  Row row;
  FacilitySolution solution;
  if (instance.medians > 0) {
    row.solution_seconds = seconds_of([&] { solution = k_median(matrix, instance.medians); });
    row.solution = solution.cost();
    row.bound = solution.lower_bound;
    return row;
  }
  row.solution_seconds = seconds_of([&] { solution = solve(matrix); });
  row.solution = solution.cost();
  row.bound_seconds = seconds_of([&] { row.bound = lower_bound(matrix, solution).lower_bound; });
  row.growth_seconds =
      seconds_of([&] { solution = solve(matrix, {.strategy = FacilityStrategy::jain_vazirani}); });
  row.growth = solution.cost();
  row.growth_bound = solution.lower_bound;
  row.stars_seconds =
      seconds_of([&] { solution = solve(matrix, {.strategy = FacilityStrategy::greedy_stars}); });
  row.stars = solution.cost();
  row.stars_bound = solution.lower_bound;
  return row;
}

struct Summary {
  unsigned count = 0;
  double sum = 0.0, worst = -1e300, seconds = 0.0, bound = 0.0;
};

void print_table(std::vector<instances::Instance> all,
                 const std::function<void(instances::Instance&)>& load) {
  std::printf("%-34s %5s %5s %16s %9s %8s %8s %8s %8s %8s %8s %7s %7s %7s %7s\n", "instance", "m",
              "n", "optimum", "search", "JV", "JMS", "bound", "JV bnd", "JMS bnd", "seconds",
              "bound s", "JV s", "JMS s", "");
  std::map<std::string, Summary> groups;
  for (instances::Instance& instance : all) {
    load(instance);
    const Row row = measure(instance);
    const bool known = instance.optimum > 0.0;
    const double optimum = known ? instance.optimum : row.bound;
    const auto percent = [optimum](double cost) { return 100.0 * (cost / optimum - 1.0); };
    std::printf("%-34s %5zu %5zu %16.3f %9.4f ", instance.file.c_str(), instance.facilities,
                instance.clients, optimum, percent(row.solution));
    if (instance.medians > 0) {
      std::printf("%8s %8s %8.3f %8s %8s %8.3f %7s %7s %7s k = %zu\n", "", "", percent(row.bound),
                  "", "", row.solution_seconds, "", "", "", instance.medians);
    } else {
      std::printf("%8.2f %8.2f %8.3f %8.2f %8.2f %8.3f %7.3f %7.3f %7.3f %s\n", percent(row.growth),
                  percent(row.stars), percent(row.bound), percent(row.growth_bound),
                  percent(row.stars_bound), row.solution_seconds, row.bound_seconds,
                  row.growth_seconds, row.stars_seconds,
                  !known            ? "of the bound"
                  : instance.proved ? ""
                                    : "not proved");
    }
    Summary& group = groups[instance.group()];
    ++group.count;
    group.sum += percent(row.solution);
    group.worst = std::max(group.worst, percent(row.solution));
    group.seconds = std::max(group.seconds, row.solution_seconds);
    group.bound += percent(row.bound);
    instance.connection = {};
  }
  std::printf("\n%-20s %5s %9s %9s %11s %10s\n", "group", "", "mean %", "worst %", "most secs",
              "bound %");
  for (const auto& [name, group] : groups) {
    std::printf("%-20s %5u %9.4f %9.4f %11.3f %10.3f\n", name.c_str(), group.count,
                group.sum / group.count, group.worst, group.seconds, group.bound / group.count);
  }
}

// Makes an instance of facilities and clients in a square.
instances::Instance random_instance(std::size_t facilities, std::size_t clients,
                                    std::size_t medians, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  instances::Instance instance;
  instance.facilities = facilities;
  instance.clients = clients;
  instance.medians = medians;
  instance.file = (medians > 0 ? "made/k-median " : "made/square ") + std::to_string(seed);
  std::vector<Point3> at(facilities + clients);
  for (Point3& p : at) p = {inputs::uniform(random), inputs::uniform(random), 0.0};
  for (std::size_t j = 0; j < facilities; ++j) {
    instance.opening.push_back(2.0 + inputs::uniform(random));
    for (std::size_t i = 0; i < clients; ++i) {
      const Point3 &a = at[j], &b = at[facilities + i];
      instance.connection.push_back(std::hypot(a[0] - b[0], a[1] - b[1]));
    }
  }
  return instance;
}

void print_points() {
  std::printf("\n%-34s %9s %9s %9s %9s %9s\n", "points", "clusters", "steps", "threads", "gap %",
              "seconds");
  for (const std::size_t side :
       kSmall ? std::vector<std::size_t>{40} : std::vector<std::size_t>{100, 300, 1000}) {
    std::mt19937_64 random(20);
    const std::vector<Point3> points = inputs::dem_tiles(side, side, 30.0, 2.65, random);
    // A facility costs as much on the larger models as on the model of 10,000 points.
    const double facility_cost = 100.0 / static_cast<double>(side);
    BlockClusterer clusterer;
    BlockClustering clustering;
    clusterer.run(points, {}, {.facility_cost = facility_cost, .effort = Effort::fine}, clustering);
    FacilitySolution solution;
    solution.facilities = clustering.facilities;
    solution.assignment = clustering.assignment;
    solution.opening_cost =
        clustering.facility_cost * static_cast<double>(clustering.facilities.size());
    solution.connection_cost = clustering.connection_cost;
    FacilityPoints problem;
    problem.points = points;
    problem.facility_cost = facility_cost;
    for (const std::uint32_t steps : {20u, 100u}) {
      if (side > 300 && steps > 20) continue;
      for (const unsigned threads : {1u, 2u}) {
        const double seconds = seconds_of([&] {
          solution.lower_bound =
              lower_bound(problem, solution, {.steps = steps, .threads = threads}).lower_bound;
        });
        std::printf("elevation model, %-17zu %9zu %9u %9u %9.3f %9.3f\n", points.size(),
                    solution.facilities.size(), steps, threads, 100.0 * solution.gap(), seconds);
      }
    }
  }
}

void print_medians() {
  std::printf("\n%-34s %9s %9s %12s %9s\n", "k-median of points", "k", "threads", "cost",
              "seconds");
  std::mt19937_64 random(20);
  const std::vector<Point3> points = inputs::cube(kSmall ? 500 : 20000, random);
  FacilityPoints problem;
  problem.points = points;
  for (const std::size_t k :
       kSmall ? std::vector<std::size_t>{5} : std::vector<std::size_t>{20, 200}) {
    for (const unsigned threads : {1u, 2u}) {
      FacilitySolution solution;
      const double seconds = seconds_of([&] {
        solution = k_median(problem, k, {.restarts = 1, .bound_steps = 0, .threads = threads});
      });
      std::printf("uniform in a cube, %-15zu %9zu %9u %12.4f %9.3f\n", points.size(), k, threads,
                  solution.cost(), seconds);
    }
  }
}

}  // namespace

int main() {
  const auto folder = kSmall ? std::nullopt : instances::folder();
  if (folder) {
    print_table(instances::listed(*folder),
                [&](instances::Instance& instance) { instances::load(*folder, instance); });
  } else {
    const std::size_t scale = kSmall ? 1 : 5;
    std::vector<instances::Instance> all;
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      all.push_back(random_instance(40 * scale, 60 * scale, 0, seed));
      all.push_back(random_instance(40 * scale, 60 * scale, 5 * scale, seed));
    }
    print_table(std::move(all), [](instances::Instance&) {});
  }
  print_points();
  print_medians();
  return 0;
}
