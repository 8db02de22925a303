// SPDX-License-Identifier: GPL-3.0-or-later
// For tests that compare with PROJ: reads lines "CRS longitude latitude" (degrees on the system's
// own datum), writes "x y longitude latitude", the place in the system and back again.
#include <cstdio>
#include <iostream>
#include <map>
#include <string>

#include "earth/crs/coordinate_system.hpp"

int main() {
  using terrace::terrain::CoordinateSystem;
  using terrace::terrain::Point2;
  std::map<std::string, CoordinateSystem> systems;
  std::string crs;
  Point2 place;
  try {
    while (std::cin >> crs >> place[0] >> place[1]) {
      auto found = systems.find(crs);
      if (found == systems.end()) found = systems.emplace(crs, CoordinateSystem::parse(crs)).first;
      Point2 plane = place;
      found->second.from_own_geographic({&plane, 1});
      Point2 back = plane;
      found->second.to_own_geographic({&back, 1});
      std::printf("%.17g %.17g %.17g %.17g\n", plane[0], plane[1], back[0], back[1]);
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
