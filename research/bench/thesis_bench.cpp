// SPDX-License-Identifier: GPL-3.0-or-later
// Reruns the experiments of J. Skála, Algorithms for manipulating large geometric data, on
// synthetic inputs. The thesis's own figures are next to ours in square brackets. They are for
// comparison only: data and machines differ, and the thesis's counts differ between its tables. Its
// logarithm is decimal, and its speed-ups are fractions of time saved. With TERRACE_BENCH_SMALL
// set, runs everything once on tiny inputs.
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>

#include "setting.hpp"

namespace {

using namespace terrace::research;

struct Part {
  std::string_view name;
  void (*run)(Setting&);
};
constexpr std::array kParts{Part{"table7.1", table_7_1},     Part{"table7.4", table_7_4},
                            Part{"table7.5", table_7_5},     Part{"table7.6", table_7_6},
                            Part{"table7.7", table_7_7},     Part{"table7.8", table_7_8},
                            Part{"figure7.5", figure_7_5},   Part{"figure7.6", figure_7_6},
                            Part{"figure7.12", figure_7_12}, Part{"figure7.13", figure_7_13},
                            Part{"figure7.14", figure_7_14}, Part{"figure7.21", figure_7_21},
                            Part{"figure7.22", figure_7_22}, Part{"figure7.23", figure_7_23},
                            Part{"figure7.24", figure_7_24}, Part{"table8.1", table_8_1},
                            Part{"section8.2", section_8_2}};

constexpr const char* kUsage =
    "usage: thesis_bench [--full] [--out DIR] [--tables LIST] [--threads N]\n"
    "  --full        sets as large as the thesis's (default: 1 M points at most); takes hours\n"
    "  --out DIR     write tables as CSV and plots as SVG to DIR\n"
    "  --tables LIST some of table7.1,table7.4,...,table7.8,table8.1,figure7.5,figure7.6,\n"
    "                figure7.12,...,figure7.14,figure7.21,...,figure7.24,section8.2; all by "
    "default\n"
    "  --threads N   for what the thesis ran on four threads; all processors by default\n";

/// Removes the first name from a comma-separated list and returns it.
std::string_view take(std::string_view& list) {
  const std::size_t comma = list.find(',');
  const std::string_view name = list.substr(0, comma);
  list = comma == std::string_view::npos ? "" : list.substr(comma + 1);
  return name;
}

struct Options {
  bool full = false;
  std::optional<std::filesystem::path> out;
  std::array<bool, kParts.size()> selected{};
  unsigned threads = std::max(1u, std::thread::hardware_concurrency());
};

Options parse(int argc, char** argv) {
  Options options;
  options.selected.fill(true);
  for (int i = 1; i < argc; ++i) {
    const std::string_view option = argv[i];
    if (option == "--full") {
      options.full = true;
      continue;
    }
    if (option != "--out" && option != "--tables" && option != "--threads") {
      throw std::invalid_argument("unknown option " + std::string(option));
    }
    if (++i == argc) throw std::invalid_argument(std::string(option) + " needs a value");
    std::string_view value = argv[i];
    if (option == "--out") {
      options.out = value;
    } else if (option == "--threads") {
      const unsigned long threads = std::strtoul(argv[i], nullptr, 10);
      if (threads < 1 || threads > 1024) {
        throw std::invalid_argument("--threads needs a number from 1 to 1024");
      }
      options.threads = static_cast<unsigned>(threads);
    } else {
      options.selected.fill(false);
      while (!value.empty()) {
        const std::string_view name = take(value);
        std::size_t part = 0;
        while (part < kParts.size() && kParts[part].name != name) ++part;
        if (part == kParts.size())
          throw std::invalid_argument("--tables: unknown name " + std::string(name));
        options.selected[part] = true;
      }
    }
  }
  return options;
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  try {
    options = parse(argc, argv);
  } catch (const std::invalid_argument& error) {
    std::fprintf(stderr, "%s\n%s", error.what(), kUsage);
    return 2;
  }
  try {
    Report report(options.out);
    Setting setting{.size = std::getenv("TERRACE_BENCH_SMALL") != nullptr ? Setting::Size::small
                            : options.full                                ? Setting::Size::full
                                                                          : Setting::Size::standard,
                    .threads = options.threads,
                    .report = report};
    report.note(machine());
    const auto start = std::chrono::steady_clock::now();
    for (std::size_t part = 0; part < kParts.size(); ++part) {
      if (options.selected[part]) kParts[part].run(setting);
    }
    const std::chrono::duration<double> all = std::chrono::steady_clock::now() - start;
    report.note("\n" + fixed(all.count(), 1) + " s in all" +
                (options.out ? "; tables and plots in " + options.out->string() : ""));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
