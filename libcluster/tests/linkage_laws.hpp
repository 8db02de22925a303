// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "inputs.hpp"
#include "terrace/cluster/dendrogram.hpp"
#include "terrace/cluster/linkage.hpp"
#include "terrace/cluster/point.hpp"

/// Checks of linkage by brute force, and inputs that break careless code.

namespace terrace::cluster::laws {

template <class T>
void shuffle(std::vector<T>& items, std::mt19937_64& random) {
  for (std::size_t i = items.size(); i > 1; --i) std::swap(items[i - 1], items[random() % i]);
}

inline bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

/// Returns the message of the std::invalid_argument that `action` throws.
inline std::string message_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "no exception";
}

inline std::vector<double> heights_of(const Dendrogram& dendrogram) {
  std::vector<double> heights;
  for (const Merge& merge : dendrogram.merges) heights.push_back(merge.height);
  return heights;
}

using Distances = std::vector<std::vector<double>>;  // square, symmetric

inline Distances distances_of(const std::vector<Point3>& points) {
  Distances d(points.size(), std::vector<double>(points.size(), 0.0));
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t j = 0; j < points.size(); ++j) {
      // Uses long double, whose range holds the squares of all doubles.
      long double sum = 0;
      for (unsigned a = 0; a < 3; ++a) {
        const long double v = static_cast<long double>(points[i][a]) - points[j][a];
        sum += v * v;
      }
      d[i][j] = static_cast<double>(std::sqrt(sum));
    }
  }
  return d;
}

/// Runs textbook agglomeration in O(n^3): the nearest two clusters merge repeatedly, and `combine`
/// gives the distance to the new cluster. Returns the heights.
inline std::vector<double> brute_heights(Distances d, bool complete) {
  std::vector<double> heights;
  std::vector<std::size_t> active(d.size());
  for (std::size_t i = 0; i < d.size(); ++i) active[i] = i;
  while (active.size() > 1) {
    std::size_t x = 0;
    std::size_t y = 1;
    for (std::size_t i = 0; i < active.size(); ++i) {
      for (std::size_t j = i + 1; j < active.size(); ++j) {
        if (d[active[i]][active[j]] < d[active[x]][active[y]]) {
          x = i;
          y = j;
        }
      }
    }
    const std::size_t a = active[x];
    const std::size_t b = active[y];
    heights.push_back(d[a][b]);
    for (const std::size_t k : active) {
      const double other = complete ? std::max(d[a][k], d[b][k]) : std::min(d[a][k], d[b][k]);
      d[a][k] = d[k][a] = other;
    }
    active.erase(active.begin() + static_cast<std::ptrdiff_t>(y));
  }
  return heights;
}

/// Returns the points of each cluster, including the clusters made by rows.
inline std::vector<std::vector<std::uint32_t>> members_of(const Dendrogram& dendrogram) {
  std::vector<std::vector<std::uint32_t>> members(dendrogram.points);
  for (std::uint32_t i = 0; i < dendrogram.points; ++i) members[i] = {i};
  for (const Merge& merge : dendrogram.merges) {
    std::vector<std::uint32_t> both = members[merge.a];
    both.insert(both.end(), members[merge.b].begin(), members[merge.b].end());
    members.push_back(both);
  }
  return members;
}

/// Relative tolerance of heights computed from a float matrix, whose entries are rounded once.
inline constexpr double kFloatTolerance = 1e-7;

/// Returns the distance of a cluster to one made of two parts, from the distances to the parts: the
/// definitions of the methods by G. Lance and W. Williams.
inline double combined_distance(LinkageMethod method, double a, double b, double between, double na,
                                double nb, double n) {
  const auto root = [](double square) { return std::sqrt(std::max(square, 0.0)); };
  switch (method) {
    case LinkageMethod::single:
      return std::min(a, b);
    case LinkageMethod::complete:
      return std::max(a, b);
    case LinkageMethod::average:
      return (na * a + nb * b) / (na + nb);
    case LinkageMethod::weighted:
      return (a + b) / 2;
    case LinkageMethod::ward:
      return root(((n + na) * a * a + (n + nb) * b * b - n * between * between) / (n + na + nb));
    case LinkageMethod::centroid:
      return root((na * a * a + nb * b * b) / (na + nb) -
                  na * nb * between * between / ((na + nb) * (na + nb)));
    case LinkageMethod::median:
      return root((a * a + b * b) / 2 - between * between / 4);
  }
  return 0.0;
}

/// Checks a dendrogram as a run of linkage. Each row must merge two clusters such that no others
/// are nearer, at their distance, up to `tolerance` (relative) and `floor` (about a fraction of the
/// largest distance). Returns the fault, or an empty string. Nothing more can be required: if
/// distances are equal several runs are valid, and even their heights may differ. Takes O(n^2)
/// unless many distances are equal.
inline std::string linkage_fault(const Dendrogram& dendrogram, Distances d, LinkageMethod method,
                                 double tolerance, double floor = 0.0) {
  if (std::string fault = dendrogram_fault(dendrogram); !fault.empty()) return fault;
  // Scales the largest to near 1, exactly, because squares of distances may overflow.
  double largest = 0.0;
  for (const auto& row : d) {
    for (const double v : row) largest = std::max(largest, v);
  }
  int exponent = 0;
  if (largest > 0.0) std::frexp(largest, &exponent);
  for (auto& row : d) {
    for (double& v : row) v = std::ldexp(v, -exponent);
  }
  std::vector<std::size_t> place(dendrogram.points);  // row of d of each cluster
  for (std::size_t i = 0; i < place.size(); ++i) place[i] = i;
  std::vector<std::size_t> active = place;
  std::vector<double> size(place.size(), 1.0);
  // For each active row, the other row nearest to it.
  std::vector<std::size_t> nearest(place.size());
  const auto find_nearest = [&](std::size_t i) {
    std::size_t best = i;
    for (const std::size_t j : active) {
      if (j != i && (best == i || d[i][j] < d[i][best])) best = j;
    }
    nearest[i] = best;
  };
  for (const std::size_t i : active) find_nearest(i);
  for (const Merge& merge : dendrogram.merges) {
    const std::string row = "row " + std::to_string(place.size() - dendrogram.points) + ": ";
    const std::size_t a = place[merge.a];
    const std::size_t b = place[merge.b];
    const double height = std::ldexp(merge.height, -exponent), between = d[a][b];
    if (std::abs(height - between) > tolerance * between + floor) return row + "wrong height";
    for (const std::size_t i : active) {
      if (d[i][nearest[i]] * (1 + tolerance) + floor < height) return row + "others are nearer";
    }
    active.erase(std::find(active.begin(), active.end(), b));
    for (const std::size_t k : active) {
      if (k == a) continue;
      d[a][k] = d[k][a] =
          combined_distance(method, d[a][k], d[b][k], between, size[a], size[b], size[k]);
    }
    size[a] += size[b];
    for (const std::size_t k : active) {
      if (k == a || nearest[k] == a || nearest[k] == b || d[k][a] < d[k][nearest[k]]) {
        find_nearest(k);
      }
    }
    place.push_back(a);
  }
  return {};
}

inline std::string complete_fault(const Dendrogram& dendrogram, const Distances& d,
                                  double tolerance) {
  return linkage_fault(dendrogram, d, LinkageMethod::complete, tolerance);
}

/// Inputs of about `count` points, including degenerate ones.
struct NamedPoints {
  std::string name;
  std::vector<Point3> points;
};
inline std::vector<NamedPoints> linkage_inputs(std::size_t count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const std::vector<Point3> cube = inputs::cube(count, random);
  std::vector<NamedPoints> sets;
  const auto add = [&](const std::string& name, const std::function<void(Point3&)>& change) {
    std::vector<Point3> points = cube;
    for (Point3& p : points) change(p);
    sets.push_back({name, points});
  };
  const auto all = [](double (*change)(double)) {
    return [change](Point3& p) {
      for (double& v : p) v = change(v);
    };
  };
  add("cube", [](Point3&) {});
  add("plane", [](Point3& p) { p[2] = 0; });
  add("line", [](Point3& p) { p = {p[0], 2, 3}; });
  add("skew line", [](Point3& p) { p = {p[0], p[0] * 0.5, -p[0]}; });
  add("grid with duplicates", all([](double v) { return std::floor(v * 5); }));
  add("few places", all([](double v) { return std::floor(v * 2); }));
  add("equal", [](Point3& p) { p = {1, 2, 3}; });
  add("huge", all([](double v) { return (v - 0.5) * 1.9e307; }));
  add("tiny", all([](double v) { return v * 1e-300; }));
  add("far off", all([](double v) { return 1e6 + v; }));
  add("clumps", [&random](Point3& p) {
    for (double& v : p) v = std::floor(v * 2) * 1000 + inputs::uniform(random);
  });
  add("clumps of clumps", all([](double v) { return v * v * v * v * v * v * v * v; }));
  std::vector<Point3> grid;
  for (std::size_t i = 0; i < count; ++i) {
    grid.push_back(
        {static_cast<double>(i % 7), static_cast<double>(i / 7 % 7), static_cast<double>(i / 49)});
  }
  sets.push_back({"grid", grid});
  inputs::shuffle(grid, random);
  sets.push_back({"shuffled grid", grid});
  std::vector<Point3> geometric;
  double x = 1;
  for (std::size_t i = 0; i < count; ++i, x *= 1.3) geometric.push_back({x, 0, 0});
  sets.push_back({"geometric spacing", geometric});
  return sets;
}

}  // namespace terrace::cluster::laws
