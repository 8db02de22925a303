// SPDX-License-Identifier: GPL-3.0-or-later
// Table 8.1: removal of clusters. Random clusters of an elevation model are expanded on top of a
// coarse triangulation and then collapsed in three ways: by the model, which removes sets and keeps
// a journal; point by point; and point by point with CGAL.
#include <algorithm>
#include <array>
#include <ctime>
#include <random>
#include <string>
#include <vector>

#include <CGAL/Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include "model/multiresolution.hpp"
#include "multiresolution_hierarchy.hpp"
#include "setting.hpp"

namespace terrace::research {

using namespace tri;
using namespace tri::bench;

namespace {

using Plain = Delaunay2<std::int32_t>;
using Triangulation = Timed<Plain>;
using Model = MultiresolutionModel<Triangulation>;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Cgal = CGAL::Delaunay_triangulation_2<Kernel>;

/// Seconds on a Pentium 4 at 3.2 GHz.
struct ThesisRow {
  std::size_t clusters, points;
  double overhead, one_by_one, hole_enlarging;
};
constexpr std::array<ThesisRow, 6> kThesis{{{15, 4454, 0.01, 0.09, 0.09},
                                            {30, 9415, 0.08, 0.23, 0.17},
                                            {60, 19095, 0.35, 0.49, 0.33},
                                            {125, 36690, 1.37, 1.56, 0.72},
                                            {250, 73060, 6.66, 4.04, 1.54},
                                            {500, 146741, 35.23, 10.34, 5.54}}};

/// CPU time of the process, which has one thread. It is less affected by other load on the machine
/// than wall time.
double now() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

Plain::Point plane(const Point3& p) {
  return {static_cast<std::int32_t>(p[0]), static_cast<std::int32_t>(p[1])};
}

std::vector<ClusterId> draw(const ArraySource& source, std::size_t count, std::mt19937_64& random) {
  std::vector<std::uint64_t> all(source.cluster_count(0));
  for (std::size_t k = 0; k < all.size(); ++k) all[k] = k;
  std::vector<ClusterId> sample;
  for (std::size_t k = 0; k < std::min(count, all.size()); ++k) {
    const auto remaining = static_cast<double>(all.size() - k);
    std::swap(all[k], all[k + static_cast<std::size_t>(unit(random) * remaining)]);
    sample.push_back(cluster_id(0, all[k]));
  }
  return sample;
}

struct Times {
  double sets = 0.0, bookkeeping = 0.0, one_by_one = 0.0, cgal = 0.0;
  std::size_t points = 0;
};

/// The overhead of the model and its journal: its total time minus the time of the triangulation
/// and the source.
void bookkeeping(ArraySource& source, const std::vector<ClusterId>& clusters, int rounds,
                 Times& times) {
  std::vector<double> own;
  Model model(source, {1, {}});
  for (int round = 0; round < rounds; ++round) {
    for (const ClusterId id : clusters) model.expand(id);
    const double others = Triangulation::seconds() + source.seconds;
    double total = 0.0;
    {
      const Lap lap(total);
      for (const ClusterId id : clusters) model.collapse(id);
    }
    own.push_back(total - (Triangulation::seconds() + source.seconds - others));
  }
  times.bookkeeping = median(own);
}

/// Removes the clusters' points, each cluster as a set or point by point.
void removal(ArraySource& source, const std::vector<ClusterId>& clusters, int rounds,
             Times& times) {
  Plain triangulation;
  std::vector<Plain::Point> base;
  for (const Point3& p : source.levels.back().positions) base.push_back(plane(p));
  triangulation.build(base);
  std::vector<std::vector<VertexId>> sets(clusters.size());
  const auto insert = [&] {
    times.points = 0;
    for (std::size_t k = 0; k < clusters.size(); ++k) {
      std::vector<Plain::Point> points;
      for (const Point3& p : source.read(clusters[k]).positions) points.push_back(plane(p));
      std::vector<Plain::Insertion> insertions(points.size());
      if (!points.empty()) {
        triangulation.insert(points, insertions, triangulation.nearest(points[0]));
      }
      sets[k].clear();
      for (const auto& insertion : insertions) sets[k].push_back(insertion.vertex);
      times.points += points.size();
    }
  };
  std::vector<double> as_sets, one_by_one;
  for (int round = 0; round < rounds; ++round) {
    insert();
    double begin = now();
    for (const auto& set : sets) triangulation.remove(set);
    as_sets.push_back(now() - begin);
    insert();
    begin = now();
    for (const auto& set : sets) {
      for (const VertexId vertex : set) triangulation.remove(vertex);
    }
    one_by_one.push_back(now() - begin);
  }
  times.sets = median(as_sets);
  times.one_by_one = median(one_by_one);
}

void point_by_point_cgal(ArraySource& source, const std::vector<ClusterId>& clusters, int rounds,
                         Times& times) {
  Cgal triangulation;
  std::vector<Kernel::Point_2> base;
  for (const Point3& p : source.levels.back().positions) base.emplace_back(p[0], p[1]);
  triangulation.insert(base.begin(), base.end());
  std::vector<double> seconds;
  for (int round = 0; round < rounds; ++round) {
    std::vector<Cgal::Vertex_handle> vertices;
    for (const ClusterId id : clusters) {
      Cgal::Face_handle hint;
      for (const Point3& p : source.read(id).positions) {
        vertices.push_back(triangulation.insert(Kernel::Point_2(p[0], p[1]), hint));
        hint = vertices.back()->face();
      }
    }
    const double begin = now();
    for (const auto& vertex : vertices) triangulation.remove(vertex);
    seconds.push_back(now() - begin);
  }
  times.cgal = median(seconds);
}

}  // namespace

void table_8_1(Setting& setting) {
  std::mt19937_64 random(1);
  const int rounds = setting.is_small() ? 1 : 7;
  const int side = setting.is_small() ? 256 : 2048;
  ArraySource source = make_hierarchy(grid_points(side), 1, 294.0, random);
  Table table{"table-8.1",
              "Table 8.1: clusters of a " + std::to_string(side) + " x " + std::to_string(side) +
                  " elevation model collapsed above its representatives, milliseconds, median of " +
                  std::to_string(rounds) + ".\n[..]: the thesis, seconds.",
              {"clusters", "points", "[points]", "bookkeeping", "[overhead]", "one by one",
               "[one by one]", "as sets", "[hole enlarging]", "CGAL", "to own", "to CGAL"}};
  for (const ThesisRow& row : kThesis) {
    const std::vector<ClusterId> clusters = draw(source, row.clusters, random);
    Times times;
    bookkeeping(source, clusters, rounds, times);
    removal(source, clusters, rounds, times);
    point_by_point_cgal(source, clusters, rounds, times);
    table.add({std::to_string(clusters.size()), grouped(times.points), cited(grouped(row.points)),
               fixed(1e3 * times.bookkeeping, 2), cited(fixed(row.overhead, 2)),
               fixed(1e3 * times.one_by_one, 2), cited(fixed(row.one_by_one, 2)),
               fixed(1e3 * times.sets, 2), cited(fixed(row.hole_enlarging, 2)),
               fixed(1e3 * times.cgal, 2), fixed(times.one_by_one / times.sets, 1) + " x",
               fixed(times.cgal / times.sets, 1) + " x"});
  }
  setting.report.table(table);
}

}  // namespace terrace::research
