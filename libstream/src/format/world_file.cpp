// SPDX-License-Identifier: Apache-2.0
#include "format/world_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <string_view>
#include <system_error>
#include <vector>

#include "io/line_reader.hpp"
#include "io/number.hpp"
#include "io/text.hpp"
#include "raster/plain_world.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/input.hpp"

namespace terrace::stream {
namespace {

namespace fs = std::filesystem;

/// ".tfw", ".tifw" and ".wld" for ".tif", each in lower and in upper case.
std::vector<std::string> world_endings(const std::string& ending) {
  std::vector<std::string> lower;
  if (ending.size() > 2) {
    lower.push_back(ending.substr(0, 2) + ending.back() + 'w');
    lower.push_back(ending + 'w');
  }
  lower.emplace_back(".wld");
  std::vector<std::string> all;
  for (std::string& name : lower) {
    std::string upper = name;
    for (char& c : upper) {
      if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 32);
    }
    all.push_back(std::move(name));
    all.push_back(std::move(upper));
  }
  return all;
}

/// Decimal commas are read as points.
bool read_number(std::string_view line, double& number) {
  std::string digits(line);
  std::replace(digits.begin(), digits.end(), ',', '.');
  const char* const end = digits.data() + digits.size();
  return !digits.empty() && parse_real(digits.data(), end, number) == end && std::isfinite(number);
}

WorldTransform read_world_file(const std::string& file) {
  Input input(file);
  LineReader lines(input);
  std::array<double, 6> numbers{};
  std::string_view line;
  for (double& number : numbers) {
    const bool more = lines.next(line);
    if (!more || !read_number(trim(line), number)) {
      throw Error(file, "a world file has six numbers, one on each line")
          .at_line(lines.number())
          .remedy("correct or remove it");
    }
  }
  const auto [a, d, b, e, c, f] = numbers;
  const double area = a * e - b * d;
  if (!std::isfinite(area) || area == 0) {
    throw Error(file, "does not map cells to distinct places").remedy("correct or remove it");
  }
  return {{a, b, c, d, e, f}};
}

}  // namespace

std::optional<WorldFile> world_file_of(const std::string& file) {
  if (file == kStandardStream) return std::nullopt;
  const std::string ending = lower_case(fs::path(file).extension().string());
  for (const std::string& world_ending : world_endings(ending)) {
    const fs::path path = fs::path(file).replace_extension(world_ending);
    std::error_code ignored;
    if (!fs::is_regular_file(path, ignored)) continue;
    return WorldFile{.name = path.string(), .world = read_world_file(path.string())};
  }
  return std::nullopt;
}

void place_by_world_file(const std::string& file, RasterInfo& info) {
  const auto comment = std::find(info.comments.begin(), info.comments.end(), kNoGeoreferencing);
  if (comment == info.comments.end()) return;
  const std::optional<WorldFile> found = world_file_of(file);
  if (!found) return;
  info.world = found->world;
  info.comments.erase(comment);
}

}  // namespace terrace::stream
