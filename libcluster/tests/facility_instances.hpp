// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "terrace/cluster/facility_location.hpp"

/// Facility location and p-median instances of OR-Library and UflLib, for tests and benchmarks.

namespace terrace::cluster::instances {

struct Instance {
  std::string file;    ///< relative to the folder of facility instances
  std::string format;  ///< orlib, simple, or pmed
  double optimum = 0.0;
  bool proved = true;       ///< otherwise `optimum` is the best value known
  std::size_t medians = 0;  ///< k of a p-median instance, otherwise 0
  std::size_t facilities = 0, clients = 0;
  std::vector<double> opening, connection;

  [[nodiscard]] FacilityMatrix matrix() const { return {facilities, clients, opening, connection}; }
  /// Returns the folder: orlib, kratica_M, pmedian, or UflLib's own folder.
  [[nodiscard]] std::string group() const {
    return std::filesystem::path(file).parent_path().filename().string();
  }
  [[nodiscard]] bool is_metric() const {
    return group() == "GalvaoRaggi" || group() == "KoerkelGhosh-sym" || group() == "Euclid" ||
           group() == "pmedian";
  }
};

/// Words of a text, and the numbers among them. Every error names the source.
class Words {
 public:
  Words(std::string source, std::string text)
      : source_(std::move(source)), text_(std::move(text)) {}

  [[noreturn]] void fail(const std::string& what) const {
    throw std::invalid_argument(source_ + ": " + what);
  }
  std::string_view word() {
    const auto from = text_.find_first_not_of(" \t\r\n", at_);
    if (from == std::string::npos) fail("is truncated");
    at_ = std::min(text_.find_first_of(" \t\r\n", from), text_.size());
    return std::string_view(text_).substr(from, at_ - from);
  }
  double number() {
    const std::string_view text = word();
    double value = 0.0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size() || !(value >= 0.0)) {
      fail(std::string(text) + " is not a number of at least 0");
    }
    return value;
  }
  std::size_t count(std::size_t least, std::size_t most) {
    const double value = number();
    if (!(value >= static_cast<double>(least) && value <= static_cast<double>(most)) ||
        value != static_cast<double>(static_cast<std::size_t>(value))) {
      fail(std::to_string(value) + " is not a count from " + std::to_string(least) + " to " +
           std::to_string(most));
    }
    return static_cast<std::size_t>(value);
  }
  void end() const {
    if (text_.find_first_not_of(" \t\r\n", at_) != std::string::npos) fail("has trailing data");
  }

 private:
  std::string source_, text_;
  std::size_t at_ = 0;
};

inline constexpr std::size_t kMaxPlaces = 10000;

/// Reads "m n", m times "capacity opening-cost", then per client its demand and m costs, each for
/// the whole demand. A capacity may be the word `capacity`; capacities are not used.
inline void read_orlib(Words& words, Instance& instance) {
  instance.facilities = words.count(1, kMaxPlaces);
  instance.clients = words.count(1, kMaxPlaces);
  for (std::size_t j = 0; j < instance.facilities; ++j) {
    words.word();
    instance.opening.push_back(words.number());
  }
  instance.connection.resize(instance.facilities * instance.clients);
  for (std::size_t i = 0; i < instance.clients; ++i) {
    words.number();
    for (std::size_t j = 0; j < instance.facilities; ++j) {
      instance.connection[j * instance.clients + i] = words.number();
    }
  }
  words.end();
}

/// Reads "FILE: name", "m n 0", then per facility "number opening-cost" and n costs.
inline void read_simple(Words& words, Instance& instance) {
  if (words.word() != "FILE:") words.fail("does not begin with FILE:");
  words.word();
  instance.facilities = words.count(1, kMaxPlaces);
  instance.clients = words.count(1, kMaxPlaces);
  words.count(0, 0);
  for (std::size_t j = 0; j < instance.facilities; ++j) {
    words.count(j + 1, j + 1);
    instance.opening.push_back(words.number());
    for (std::size_t i = 0; i < instance.clients; ++i) {
      instance.connection.push_back(words.number());
    }
  }
  words.end();
}

/// Reads "n edges k", then "from to length" per edge. Of repeated edges the last one counts. Costs
/// are the lengths of shortest paths.
inline void read_pmed(Words& words, Instance& instance) {
  const std::size_t n = words.count(1, kMaxPlaces);
  const std::size_t edges = words.count(0, n * n);
  instance.medians = words.count(1, n);
  instance.facilities = instance.clients = n;
  instance.opening.assign(n, 0.0);
  constexpr double kFar = std::numeric_limits<double>::infinity();
  std::vector<double>& d = instance.connection;
  d.assign(n * n, kFar);
  for (std::size_t e = 0; e < edges; ++e) {
    const std::size_t a = words.count(1, n) - 1;
    const std::size_t b = words.count(1, n) - 1;
    d[a * n + b] = d[b * n + a] = words.number();
  }
  words.end();
  for (std::size_t j = 0; j < n; ++j) d[j * n + j] = 0.0;
  for (std::size_t via = 0; via < n; ++via) {
    for (std::size_t a = 0; a < n; ++a) {
      const double there = d[a * n + via];
      if (there == kFar) continue;
      for (std::size_t b = 0; b < n; ++b) {
        d[a * n + b] = std::min(d[a * n + b], there + d[via * n + b]);
      }
    }
  }
  if (std::find(d.begin(), d.end(), kFar) != d.end()) words.fail("the graph is not connected");
}

inline void parse(Words words, Instance& instance) {
  if (instance.format == "orlib") {
    read_orlib(words, instance);
  } else if (instance.format == "simple") {
    read_simple(words, instance);
  } else if (instance.format == "pmed") {
    read_pmed(words, instance);
  } else {
    words.fail(instance.format + " is not a known format");
  }
}

inline std::string read_text(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::invalid_argument(path.string() + " cannot be read");
  std::ostringstream text;
  text << file.rdbuf();
  return std::move(text).str();
}

/// Returns the folder of instances in the folder named by TERRACE_DATA, or nullopt if there is
/// none.
inline std::optional<std::filesystem::path> folder() {
  const char* const data = std::getenv("TERRACE_DATA");
  if (data == nullptr) return std::nullopt;
  std::filesystem::path path = std::filesystem::path(data) / "facility";
  if (!std::filesystem::exists(path / "optima.tsv")) return std::nullopt;
  return path;
}

/// Returns the instances that optima.tsv lists, without their costs, which load() reads.
inline std::vector<Instance> listed(const std::filesystem::path& folder) {
  std::istringstream lines(read_text(folder / "optima.tsv"));
  std::vector<Instance> all;
  for (std::string line; std::getline(lines, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream fields(line);
    std::string field[6];
    for (std::string& f : field) {
      if (!std::getline(fields, f, '\t')) throw std::invalid_argument("optima.tsv: " + line);
    }
    Words numbers("optima.tsv", field[1] + " " + field[2] + " " + field[4]);
    Instance instance;
    instance.file = field[0];
    instance.format = field[3].substr(0, field[3].find(' '));
    instance.facilities = numbers.count(1, kMaxPlaces);
    instance.clients = numbers.count(1, kMaxPlaces);
    instance.optimum = numbers.number();
    instance.proved = field[5].find("not proved") == std::string::npos;
    all.push_back(std::move(instance));
  }
  return all;
}

/// Reads the costs of a listed instance.
/// Throws: std::invalid_argument if the file does not match the list.
inline void load(const std::filesystem::path& folder, Instance& instance) {
  const std::size_t facilities = instance.facilities, clients = instance.clients;
  parse(Words(instance.file, read_text(folder / instance.file)), instance);
  if (instance.facilities != facilities || instance.clients != clients) {
    throw std::invalid_argument(instance.file + ": the size differs from optima.tsv");
  }
}

}  // namespace terrace::cluster::instances
