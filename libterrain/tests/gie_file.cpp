// SPDX-License-Identifier: GPL-3.0-or-later
#include "gie_file.hpp"

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <sstream>
#include <stdexcept>

namespace terrace::terrain::gie {
namespace {

/// "0.1 mm", "1e-15m", "50 nm", "3e8" (metres).
double tolerance_of(const std::string& text, int line) {
  char* end = nullptr;
  const double number = std::strtod(text.c_str(), &end);
  std::string unit;
  std::istringstream(end) >> unit;
  if (unit.empty() || unit == "m") return number;
  if (unit == "cm") return number * 1e-2;
  if (unit == "mm") return number * 1e-3;
  if (unit == "um") return number * 1e-6;
  if (unit == "nm") return number * 1e-9;
  throw std::runtime_error("line " + std::to_string(line) + ": tolerance " + text);
}

std::vector<double> numbers_of(std::istringstream& words, int line) {
  std::vector<double> numbers;
  for (std::string word; words >> word;) {
    const auto number = gie_number(word);
    if (!number) throw std::runtime_error("line " + std::to_string(line) + ": " + word);
    numbers.push_back(*number);
  }
  return numbers;
}

/// Reads commands one by one, as PROJ's program of that name does.
class Reader {
 public:
  void command(const std::string& name, const std::string& rest, int line, bool strict) {
    std::istringstream words(rest);
    if (name == "operation") {
      operations_.push_back({.line = line, .text = rest, .cases = {}});
      state_ = {};
    } else if (operations_.empty()) {
      throw std::runtime_error("line " + std::to_string(line) + ": " + name +
                               " before any operation");
    } else if (name == "tolerance") {
      state_.tolerance = tolerance_of(rest, line);
    } else if (name == "direction") {
      state_.inverse = rest.starts_with("inv");
    } else if (name == "accept") {
      state_.accept = numbers_of(words, line);
    } else if (name == "expect" && rest.starts_with("failure")) {
      if (state_.accept.empty()) {
        operations_.back().refused = true;
      } else {
        add(line).failure = true;
      }
    } else if (name == "expect") {
      GieCase& added = add(line);
      added.expect = numbers_of(words, line);
    } else if (name == "roundtrip") {
      GieCase& added = add(line);
      words >> added.round_trips;
      std::string tolerance;
      std::getline(words >> std::ws, tolerance);
      if (!tolerance.empty()) added.tolerance = tolerance_of(tolerance, line);
    } else if (strict) {
      throw std::runtime_error("line " + std::to_string(line) + ": command " + name);
    } else if (name[0] == '+') {
      // Without strictness operations go on in the next line by themselves, and what is not known
      // is no matter.
      operations_.back().text += ' ' + name + ' ' + rest;
    }
  }
  std::vector<GieOperation> take() { return std::move(operations_); }

 private:
  GieCase& add(int line) {
    operations_.back().cases.push_back(state_);
    operations_.back().cases.back().line = line;
    return operations_.back().cases.back();
  }

  std::vector<GieOperation> operations_;
  GieCase state_;
};

}  // namespace

std::optional<double> gie_number(const std::string& text) {
  std::string plain;
  for (const char c : text) {
    if (c != '_') plain += c;
  }
  if (plain == "NaN") return std::numeric_limits<double>::quiet_NaN();
  double sign = 1;
  if (!plain.empty() && std::string("NSEW").find(plain.back()) != std::string::npos) {
    if (plain.back() == 'S' || plain.back() == 'W') sign = -1;
    plain.pop_back();
  }
  const char* at = plain.c_str();
  if (*at == '-') sign = -sign, ++at;
  double value = 0;
  const char marks[] = {'d', '\'', '"'};
  double part = 1;
  for (std::size_t i = 0; i < 3 && *at != '\0'; ++i, part /= 60) {
    char* end = nullptr;
    value += std::strtod(at, &end) * part;
    if (end == at) return std::nullopt;
    at = end;
    if (i == 0 && *at == 'D') ++at;
    if (*at == marks[i]) ++at;
  }
  if (*at != '\0' || plain.empty()) return std::nullopt;
  return sign * value;
}

std::optional<std::vector<GieOperation>> read_gie(const std::string& path) {
  std::ifstream file(path);
  if (!file) return std::nullopt;
  Reader reader;
  bool inside = false, strict = false, continued = false;
  std::string text, line;
  int number = 0, first = 0;
  while (std::getline(file, line)) {
    ++number;
    if (line.starts_with("<gie")) {
      inside = true;
      strict = line.starts_with("<gie-strict");
    }
    if (line.starts_with("</gie")) inside = false;
    line = line.substr(0, line.find('#'));
    line.erase(line.find_last_not_of(" \t\r") + 1);
    line.erase(0, line.find_first_not_of(" \t"));
    if (!inside || line.empty() || line[0] == '<') continue;
    if (!continued && (line.starts_with("---") || line.starts_with("==="))) continue;
    if (!continued) {
      text.clear();
      first = number;
    }
    continued = line.back() == '\\';
    if (continued) line.pop_back();
    text += line + ' ';
    if (continued) continue;
    std::istringstream words(text);
    std::string name, rest;
    words >> name;
    std::getline(words >> std::ws, rest);
    rest.erase(rest.find_last_not_of(' ') + 1);
    // How PROJ reads "init=" has no meaning here.
    if (!name.starts_with("use_proj4")) reader.command(name, rest, first, strict);
  }
  return reader.take();
}

}  // namespace terrace::terrain::gie
