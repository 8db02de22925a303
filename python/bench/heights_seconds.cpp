// SPDX-License-Identifier: Apache-2.0
// The C++ counterpart to Store.heights() in bars.py. Usage: heights_seconds STORE PLACES THREADS
// PLACES: a file of pairs of native doubles in the store's CRS. Prints the least of five times in
// seconds, and the sum of the heights.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <vector>

#include <terrace/stream/store.hpp>
#include <terrace/terrain/heights.hpp>

using namespace terrace;

int main(int argc, char** argv) {
  if (argc != 4) return std::fprintf(stderr, "usage: heights_seconds STORE PLACES THREADS\n"), 2;
  const stream::Store store = stream::Store::open(argv[1]);
  std::vector<terrain::Point2> places;
  std::ifstream file(argv[2], std::ios::binary);
  for (terrain::Point2 p; file.read(reinterpret_cast<char*>(p.data()), sizeof p);) {
    places.push_back(p);
  }
  const auto threads = static_cast<unsigned>(std::strtoul(argv[3], nullptr, 10));
  double least = std::numeric_limits<double>::infinity(), sum = 0;
  for (int round = 0; round < 5; ++round) {
    const auto begin = std::chrono::steady_clock::now();
    const auto found = terrain::sample_places(store, places, {}, {.threads = threads});
    const std::chrono::duration<double> lasted = std::chrono::steady_clock::now() - begin;
    least = std::min(least, lasted.count());
    sum = 0;
    for (const terrain::GroundPoint& point : found) {
      if (!std::isnan(point.height)) sum += point.height;
    }
  }
  std::printf("%.6f %.17g\n", least, sum);
}
