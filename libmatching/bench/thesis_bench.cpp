// SPDX-License-Identifier: Apache-2.0
// The thesis, rerun: J. Skála, Algorithms for manipulating large geometric data, figures 7.21 to
// 7.24 (section 7.5.2), on uniform random points, with our monotone method and the optimum for
// comparison. thesis_plots.py plots the output.
// With TERRACE_BENCH_SMALL set, runs everything once on tiny inputs.
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>

#include "thesis/figures.hpp"

namespace {

using namespace terrace::matching::thesis;

struct Part {
  std::string_view name;
  void (*run)(Setting&);
};
constexpr std::array kParts{Part{"figure7.21", figure_7_21}, Part{"figure7.22", figure_7_22},
                            Part{"figure7.23", figure_7_23}, Part{"figure7.24", figure_7_24}};

constexpr const char* kUsage =
    "usage: matching_thesis_bench [--full] [--out DIR] [--tables LIST] [--threads N]\n"
    "  --full        50,000 iterations for 500 points as in the thesis (default 20,000); larger n\n"
    "  --out DIR     write the figures as CSV files to DIR\n"
    "  --tables LIST some of figure7.21,figure7.22,figure7.23,figure7.24; all by default\n"
    "  --threads N   for the Monte Carlo method; all processors by default; never changes the "
    "costs\n";

struct Options {
  Setting setting;
  std::array<bool, kParts.size()> wanted{};
};

void choose(std::string_view list, std::array<bool, kParts.size()>& wanted) {
  wanted.fill(false);
  while (!list.empty()) {
    const std::size_t comma = std::min(list.find(','), list.size());
    const std::string_view name = list.substr(0, comma);
    list.remove_prefix(std::min(comma + 1, list.size()));
    std::size_t part = 0;
    while (part < kParts.size() && kParts[part].name != name) ++part;
    if (part == kParts.size())
      throw std::invalid_argument("--tables: unknown figure " + std::string(name));
    wanted[part] = true;
  }
}

Options parse(int argc, char** argv) {
  Options options;
  options.wanted.fill(true);
  options.setting.threads = std::max(1u, std::thread::hardware_concurrency());
  for (int i = 1; i < argc; ++i) {
    const std::string_view option = argv[i];
    if (option == "--full") {
      options.setting.size = Setting::Size::full;
      continue;
    }
    if (option != "--out" && option != "--tables" && option != "--threads") {
      throw std::invalid_argument("unknown option " + std::string(option));
    }
    if (++i == argc) throw std::invalid_argument(std::string(option) + " needs a value");
    if (option == "--out") {
      options.setting.out = argv[i];
    } else if (option == "--tables") {
      choose(argv[i], options.wanted);
    } else {
      const unsigned long threads = std::strtoul(argv[i], nullptr, 10);
      if (threads < 1 || threads > 1024) {
        throw std::invalid_argument("--threads needs a number from 1 to 1024");
      }
      options.setting.threads = static_cast<unsigned>(threads);
    }
  }
  if (std::getenv("TERRACE_BENCH_SMALL") != nullptr) options.setting.size = Setting::Size::small;
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
    Setting& setting = options.setting;
    if (setting.out) std::filesystem::create_directories(*setting.out);
    std::printf("%s\n", machine().c_str());
    const auto start = std::chrono::steady_clock::now();
    for (std::size_t part = 0; part < kParts.size(); ++part) {
      if (options.wanted[part]) kParts[part].run(setting);
    }
    const std::chrono::duration<double> all = std::chrono::steady_clock::now() - start;
    std::printf("\n%.1f s in all%s\n", all.count(),
                setting.out ? ("; figures as CSV in " + setting.out->string()).c_str() : "");
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
