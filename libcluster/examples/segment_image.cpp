// SPDX-License-Identifier: Apache-2.0
// Segments an image by the position and colour of its pixels.
//
//     segment_image [INPUT.ppm [OUTPUT.ppm [FACILITY_COST [COLOUR_WEIGHT]]]]
//
// Reads a binary PPM (P6, 8 bits) and writes one in which every pixel has the colour of its
// cluster's representative. Without arguments it generates a picture and checks that the segments
// are the shapes in it.
#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "terrace/cluster/facility_location.hpp"

using namespace terrace::cluster;

namespace {

struct Image {
  std::size_t width = 0, height = 0;
  std::vector<unsigned char> rgb;
};

/// Reads a number of the header. Comments run from # to the end of the line.
std::size_t header_number(std::istream& in, const std::string& path) {
  while (in >> std::ws && in.peek() == '#') {
    in.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
  }
  std::size_t value = 0;
  if (!(in >> value) || value == 0 || value > 65536) {
    throw std::runtime_error(path + ": not the header of a binary PPM");
  }
  return value;
}

Image read_ppm(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw std::runtime_error(path + ": cannot be read");
  std::array<char, 2> magic{};
  in.read(magic.data(), 2);
  if (magic[0] != 'P' || magic[1] != '6')
    throw std::runtime_error(path + ": not a binary PPM (P6)");
  Image image;
  image.width = header_number(in, path);
  image.height = header_number(in, path);
  if (header_number(in, path) != 255) throw std::runtime_error(path + ": not 8 bits per channel");
  in.get();
  image.rgb.resize(3 * image.width * image.height);
  in.read(reinterpret_cast<char*>(image.rgb.data()),
          static_cast<std::streamsize>(image.rgb.size()));
  if (!in) throw std::runtime_error(path + ": is truncated");
  return image;
}

void write_ppm(const Image& image, const std::string& path) {
  std::ofstream out(path, std::ios::binary);
  out << "P6\n" << image.width << ' ' << image.height << "\n255\n";
  out.write(reinterpret_cast<const char*>(image.rgb.data()),
            static_cast<std::streamsize>(image.rgb.size()));
  if (!out.flush()) throw std::runtime_error(path + ": cannot be written");
}

/// Returns the shape at a pixel: a background (0) with a square (1) and a disc (2) of uniform
/// colour.
int shape_at(std::size_t x, std::size_t y) {
  const double dx = static_cast<double>(x) - 70.0, dy = static_cast<double>(y) - 65.0;
  if (dx * dx + dy * dy < 20.0 * 20.0) return 2;
  return x >= 10 && x < 45 && y >= 10 && y < 45 ? 1 : 0;
}

Image made_picture() {
  constexpr std::array<std::array<int, 3>, 3> kColours{
      {{40, 90, 40}, {200, 60, 50}, {60, 80, 210}}};
  Image image{100, 96, {}};
  std::uint32_t noise = 12345;
  for (std::size_t y = 0; y < image.height; ++y) {
    for (std::size_t x = 0; x < image.width; ++x) {
      for (const int colour : kColours[static_cast<std::size_t>(shape_at(x, y))]) {
        noise = noise * 1664525u + 1013904223u;
        image.rgb.push_back(static_cast<unsigned char>(colour + static_cast<int>(noise >> 28) - 8));
      }
    }
  }
  return image;
}

/// colour_weight: the distance, in pixels, that a step of one in a colour channel is worth.
FacilitySolution segment(const Image& image, double facility_cost, double colour_weight) {
  std::vector<Point3> positions;
  for (std::size_t y = 0; y < image.height; ++y) {
    for (std::size_t x = 0; x < image.width; ++x) {
      positions.push_back({static_cast<double>(x), static_cast<double>(y), 0.0});
    }
  }
  const std::vector<double> colours(image.rgb.begin(), image.rgb.end());
  const std::vector<double> weights(3, colour_weight);
  const FacilityPoints problem{
      .points = positions, .channels = {colours, weights}, .facility_cost = facility_cost};
  return solve(problem, {.assign_nearest = true});
}

void paint(Image& image, const FacilitySolution& solution) {
  const Image before = image;
  for (std::size_t i = 0; i < solution.assignment.size(); ++i) {
    const std::size_t representative = solution.facilities[solution.assignment[i]];
    for (std::size_t c = 0; c < 3; ++c) image.rgb[3 * i + c] = before.rgb[3 * representative + c];
  }
}

/// Returns the number of pixels whose segment's representative is in another shape.
std::size_t misplaced(const Image& image, const FacilitySolution& solution) {
  const auto shape = [&](std::size_t i) { return shape_at(i % image.width, i / image.width); };
  std::size_t count = 0;
  for (std::size_t i = 0; i < solution.assignment.size(); ++i) {
    if (shape(i) != shape(solution.facilities[solution.assignment[i]])) ++count;
  }
  return count;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const bool own = argc < 2;
    Image image = own ? made_picture() : read_ppm(argv[1]);
    const double facility_cost = argc > 3 ? std::atof(argv[3]) : 20.0;
    const double colour_weight = argc > 4 ? std::atof(argv[4]) : 1.0;
    const FacilitySolution solution = segment(image, facility_cost, colour_weight);
    std::printf("%zu pixels in %zu segments, cost %.0f\n", solution.assignment.size(),
                solution.facilities.size(), solution.cost());
    if (own) {
      const std::size_t wrong = misplaced(image, solution);
      std::printf("%zu pixels in a segment of another shape\n", wrong);
      // The background may be several segments, but the shapes must be separate.
      return wrong == 0 && solution.facilities.size() >= 3 && solution.facilities.size() <= 30 ? 0
                                                                                               : 1;
    }
    paint(image, solution);
    write_ppm(image, argc > 2 ? argv[2] : "segments.ppm");
  } catch (const std::exception& error) {
    std::fprintf(stderr, "segment_image: %s\n", error.what());
    return 1;
  }
  return 0;
}
