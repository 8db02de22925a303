// SPDX-License-Identifier: Apache-2.0
// Samples heights and slopes at places of a store and along a line. Usage: heights INPUT STORE
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string_view>
#include <vector>

#include <terrace/terrain/build.hpp>
#include <terrace/terrain/heights.hpp>
#include <terrace/terrain/profile.hpp>

using namespace terrace;

int main(int argc, char** argv) {
  if (argc != 3) return std::fprintf(stderr, "usage: heights INPUT STORE\n"), 2;
  const terrain::Context context{.threads = 2};
  terrain::build_store({.inputs = {argv[1]}, .store = argv[2], .replace = true}, context);
  const stream::Store store = stream::Store::open(argv[2]);

  // Stored coordinates: columns and rows of a raster, also between samples. Pass many at once.
  const auto sampler = terrain::make_sampler(store, {}, context);
  const std::vector<terrain::Point2> places{{600, 600}, {600.5, 600.25}, {-1, 0}};
  std::vector<terrain::SurfacePoint> surface(places.size());
  sampler->sample(places, surface);
  for (std::size_t i = 0; i < places.size(); ++i) {
    std::printf("column %.2f row %.2f: height %.2f, %+.2f per column, %+.2f per row\n",
                places[i][0], places[i][1], surface[i].height, surface[i].per_column,
                surface[i].per_row);
  }

  // Coordinates of the CRS, here degrees: a row every 500 m and at the end.
  std::size_t rows = 0;
  const auto profile = terrain::write_profile(
      store, {.line = {{8.3, 46.4}, {8.6, 46.6}}, .step = 500.0},
      [&rows](std::string_view text) {
        rows += static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
      },
      context);
  std::printf("%llu heights at %zu places on %.1f km\n", 1ULL * profile.answered, rows - 1,
              profile.metres / 1000);
  const bool good = surface[0].height > 0 && surface[1].height > 0 && std::isnan(surface[2].height);
  return good && profile.answered > 0 && profile.points == rows - 1 ? 0 : 1;
}
