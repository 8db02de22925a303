// SPDX-License-Identifier: Apache-2.0
#include <charconv>
#include <cstdio>
#include <random>
#include <stdexcept>
#include <thread>

#include "figures.hpp"

namespace terrace::matching::thesis {
namespace {

std::string text_of(const Csv::Cell& cell) {
  if (const auto* text = std::get_if<std::string>(&cell)) {
    return text->find_first_of(",\"") == std::string::npos ? *text : '"' + *text + '"';
  }
  if (const auto* whole = std::get_if<std::uint64_t>(&cell)) return std::to_string(*whole);
  char digits[64];
  const auto end = std::to_chars(digits, digits + sizeof digits, std::get<double>(cell)).ptr;
  return {digits, end};
}

}  // namespace

Csv::Csv(const Setting& setting, const std::string& name, const std::string& header) {
  if (!setting.out) return;
  path_ = *setting.out / name;
  out_.open(path_, std::ios::binary);
  out_ << header << '\n';
}

void Csv::row(std::initializer_list<Cell> cells) {
  if (path_.empty()) return;
  const char* before = "";
  for (const Cell& cell : cells) {
    out_ << before << text_of(cell);
    before = ",";
  }
  out_ << '\n';
}

void Csv::close() {
  if (path_.empty()) return;
  out_.close();
  if (!out_) throw std::runtime_error("cannot write " + path_.string());
}

std::vector<Point3> uniform_points(std::size_t count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<Point3> points(count, Point3{});
  for (Point3& p : points) {
    for (const std::size_t axis : {0u, 1u}) {
      p[axis] = static_cast<double>(random() >> 11) * 0x1p-53;
    }
  }
  return points;
}

std::string machine() {
  std::string model = "unknown processor";
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    const std::size_t colon = line.find(": ");
    if (!line.starts_with("model name") || colon == std::string::npos) continue;
    model = line.substr(colon + 2);
    break;
  }
#ifdef __clang__
  const std::string compiler = __VERSION__;
#else
  const std::string compiler = "GCC " __VERSION__;
#endif
  return model + ", " + std::to_string(std::thread::hardware_concurrency()) + " cores, " + compiler;
}

std::string fixed(double value, int digits) {
  char text[400];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

}  // namespace terrace::matching::thesis
