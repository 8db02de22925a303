// SPDX-License-Identifier: GPL-3.0-or-later
// Table 7.8: complete linkage on the processor and on a GPU.
#include <algorithm>
#include <array>
#include <chrono>
#include <limits>
#include <stdexcept>

#include "linkage_laws.hpp"
#include "sets.hpp"
#include "setting.hpp"
#include "terrace/cluster/linkage.hpp"

namespace terrace::research {

using namespace cluster;

namespace {

constexpr int kRepeats = 5;

struct ThesisRow {
  const char* name;
  std::uint64_t points;
  const char* cpu;
  const char* gpu;
  const char* saved;
};
constexpr std::array<ThesisRow, 4> kThesis{{{"Objects", 1420, "2.855", "2.434", "15 %"},
                                            {"Ellipsoid", 2452, "11.985", "7.193", "40 %"},
                                            {"Cow", 2905, "25.578", "19.420", "24 %"},
                                            {"Head CT", 4098, "70.369", "54.951", "22 %"}}};

/// Throws: std::runtime_error if `dendrogram` is not a valid result of complete linkage with
/// floats.
void check(const Dendrogram& dendrogram, const laws::Distances& distances,
           const char* device_name) {
  const std::string fault = laws::complete_fault(dendrogram, distances, laws::kFloatTolerance);
  if (!fault.empty()) {
    throw std::runtime_error(std::string("complete linkage ") + device_name + ": " + fault);
  }
}

/// Returns the time of the shortest of several runs. The first also loads code and wakes the
/// device.
template <class Run>
double shortest(const Run& linkage, Dendrogram& result) {
  double best = std::numeric_limits<double>::infinity();
  for (int k = 0; k < kRepeats; ++k) {
    const auto start = std::chrono::steady_clock::now();
    result = linkage();
    const std::chrono::duration<double> time = std::chrono::steady_clock::now() - start;
    best = std::min(best, time.count());
  }
  return best;
}

}  // namespace

void table_7_8(Setting& setting) {
  const CudaStatus cuda = cuda_available();
  const std::string threads = std::to_string(setting.threads);
  Table table{"table-7.8",
              "Table 7.8: complete linkage of points, entries in float; milliseconds, the shortest "
              "of " +
                  std::to_string(kRepeats) +
                  " runs. GPU: " + (cuda.available ? cuda.device : "none (" + cuda.reason + ")") +
                  ".\n[..]: the thesis, seconds.",
              {"set", "points", "one thread", "[CPU]", threads + " threads", "GPU", "[GPU]",
               "saved", "[saved]"}};
  for (const ThesisRow& thesis : kThesis) {
    const std::uint64_t count = setting.is_small() ? thesis.points / 10 : thesis.points;
    std::vector<Point3> points(static_cast<std::size_t>(count));
    make_scan(count, count)->read(0, points);

    Dendrogram single, threaded, device;
    LinkageOptions options;
    options.entry = MatrixEntry::float32;
    const double single_time = shortest([&] { return complete_linkage(points, options); }, single);
    options.threads = setting.threads;
    const double threaded_time =
        shortest([&] { return complete_linkage(points, options); }, threaded);
    if (threaded != single) throw std::runtime_error("complete linkage depends on the threads");
    const laws::Distances distances = laws::distances_of(points);
    check(single, distances, "on the processor");
    std::vector<std::string> row{"scan, as " + std::string(thesis.name),
                                 grouped(count),
                                 fixed(1e3 * single_time, 2),
                                 cited(thesis.cpu),
                                 fixed(1e3 * threaded_time, 2),
                                 "no device",
                                 cited(thesis.gpu),
                                 "-",
                                 cited(thesis.saved)};
    if (cuda.available) {
      const double gpu_time =
          shortest([&] { return cuda_complete_linkage(points, options.entry); }, device);
      // Not necessarily the processor's dendrogram, because floats can be equal.
      check(device, distances, "on the GPU");
      row[5] = fixed(1e3 * gpu_time, 2);
      row[7] = time_saved(single_time, gpu_time);
    }
    table.add(row);
  }
  setting.report.table(table);
}

}  // namespace terrace::research
