// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>

#include <terrace/stream/store.hpp>
#include <terrace/stream/store_query.hpp>

namespace stream = terrace::stream;

/// query_store STORE [X Y Z] prints how many points are near a place (by default the centre), and
/// the ten nearest points.

int main(int argc, char** argv) {
  if (argc != 2 && argc != 5) {
    std::fprintf(stderr, "usage: query_store STORE [X Y Z]\n");
    return 2;
  }
  try {
    const stream::Store store = stream::Store::open(argv[1]);
    const stream::Box3& all = store.bounds();
    stream::Point3 place{};
    stream::Box3 around;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      place[axis] =
          argc == 5 ? std::strtod(argv[2 + axis], nullptr) : 0.5 * (all.min[axis] + all.max[axis]);
      const double tenth = 0.1 * (all.max[axis] - all.min[axis]);
      around.min[axis] = place[axis] - tenth;
      around.max[axis] = place[axis] + tenth;
    }
    stream::StoreQuery query(store);
    std::printf("%llu of %llu points in a fifth of the box\n",
                static_cast<unsigned long long>(query.count(around)),
                static_cast<unsigned long long>(store.points()));
    for (const stream::FoundPoint& found : query.nearest(place, 10)) {
      const auto [x, y, z] = found.position;
      std::printf("%.3f %.3f %.3f, %.3f away\n", x, y, z, found.distance);
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
