// SPDX-License-Identifier: GPL-3.0-or-later
#include "tables/label_file.hpp"

#include <fstream>

#include <fmt/core.h>

#include "base/units.hpp"
#include "cli/interrupt.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/sink.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

constexpr std::uint32_t kNoCluster = 0xFFFFFFFFu;

}  // namespace

std::vector<std::uint32_t> read_labels(const std::string& path, std::size_t points) {
  constexpr std::streamsize kLongestLine = 4096;  // bounds non-text files too
  std::ifstream file(path);
  if (!file) {
    throw stream::Error(path, "cannot be opened")
        .remedy("name a file with one cluster number per line");
  }
  std::vector<std::uint32_t> labels;
  std::vector<char> buffer(kLongestLine);
  while (file.getline(buffer.data(), kLongestLine) || file.gcount() > 0) {
    if (labels.size() % 65536 == 0) check_interrupt();
    const bool ended = !file.eof() && !file.fail();  // by '\n', included in gcount()
    std::string line(buffer.data(), static_cast<std::size_t>(file.gcount()) - (ended ? 1 : 0));
    if (!line.empty() && line.back() == '\r') line.pop_back();
    const std::string where = fmt::format("line {}", labels.size() + 1);
    const std::uint32_t label = number_from<std::uint32_t>(line).value_or(kNoCluster);
    if (label == kNoCluster && line != "-1") {
      throw stream::Error(path, fmt::format("'{}' is not a cluster number", line.substr(0, 40)))
          .at(where)
          .remedy(
              "write one whole number from 0 to 4294967294 per line, or -1 for a point without a "
              "cluster");
    }
    labels.push_back(label);
    if (labels.size() > points) {
      throw stream::Error(path, fmt::format("has more lines than the {}", counted(points, "point")))
          .at(where)
          .remedy("give the labels of these points, in the order of the input");
    }
  }
  if (file.bad()) {
    throw stream::Error(path, "cannot be read").at_line(labels.size() + 1).remedy("check the disk");
  }
  if (labels.size() < points) {
    throw stream::Error(path, fmt::format("has {} for {}", counted(labels.size(), "label"),
                                          counted(points, "point")))
        .remedy("give the labels of these points, in the order of the input");
  }
  return labels;
}

void write_labels(const std::string& path, std::span<const std::uint32_t> labels,
                  const stream::Naming& replace) {
  std::string text;
  for (const std::uint32_t label : labels) {
    check_interrupt();
    text += label == kNoCluster ? "-1" : fmt::format("{}", label);
    text += '\n';
  }
  stream::Sink file(path, replace, stop_token());
  file.write(text);
  file.commit();
}

}  // namespace terrace::tools
