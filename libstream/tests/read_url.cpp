// SPDX-License-Identifier: Apache-2.0
// Reads files below the URL or in the folder in argument 1, with the deadline in milliseconds of
// argument 2 and the size of the cache in argument 3. Carries out the commands on standard input,
// one a line, and prints a line for each: what was read in hexadecimal digits, a size, "ok", or
// "error: ...".
//   store [X0 Y0 X1 Y1 LEVEL]: the points of a store in a box, as number and sum of coordinates
//   open FILE | read FILE OFFSET BYTES | prefetch FILE [OFFSET BYTES]... | threads FILE OFFSET
//   BYTES
#include <chrono>
#include <iostream>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "terrace/stream/error.hpp"
#include "terrace/stream/network.hpp"
#include "terrace/stream/store.hpp"
#include "terrace/stream/store_query.hpp"

namespace {

using namespace terrace::stream;

std::string hexadecimal(const std::vector<std::byte>& bytes) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  for (const std::byte byte : bytes) {
    text += kDigits[std::to_integer<std::size_t>(byte >> 4)];
    text += kDigits[std::to_integer<std::size_t>(byte & std::byte{15})];
  }
  return text;
}

/// Returns number and sum of coordinates of the points in a box.
std::string points_in_box(const Store& store, std::istringstream& line) {
  Box3 box = store.bounds();
  unsigned level = 0;
  line >> box.min[0] >> box.min[1] >> box.max[0] >> box.max[1] >> level;
  StoreQuery query(store);
  const std::vector<FoundPoint> found = query.in_box(box, level);
  double sum = 0;
  for (const FoundPoint& point : found) {
    for (const double coordinate : point.position) sum += coordinate;
  }
  const Point3 centre = found.empty() ? box.min : found[found.size() / 2].position;
  const std::size_t near = query.nearest(centre, 5).size();
  std::ostringstream text;
  text.precision(17);
  text << found.size() << ' ' << sum << ' ' << query.count(box) << ' ' << near;
  return text.str();
}

std::string carry_out(std::istringstream& line, const OpenByName& files,
                      std::map<std::string, std::unique_ptr<ByteSource>>& open) {
  std::string command, name;
  line >> command;
  if (command == "store") return points_in_box(Store::open("store", files), line);
  line >> name;
  if (command == "open") {
    open[name] = files(name);
    return std::to_string(open[name]->size());
  }
  const ByteSource& file = *open.at(name);
  std::vector<BytePart> parts;
  for (BytePart part; line >> part.offset >> part.bytes;) parts.push_back(part);
  if (command == "prefetch") {
    file.prefetch(parts);
    return "ok";
  }
  const auto read = [&] {
    std::vector<std::byte> bytes(static_cast<std::size_t>(parts.at(0).bytes));
    file.read(parts[0].offset, bytes);
    return bytes;
  };
  if (command == "threads") {  // all read the same
    std::vector<std::jthread> threads;
    for (int i = 0; i < 8; ++i) threads.emplace_back([&] { static_cast<void>(read()); });
  }
  return hexadecimal(read());
}

}  // namespace

int main(int, char** arguments) {
  const NetworkOptions options{.deadline = std::chrono::milliseconds(std::stol(arguments[2])),
                               .cache_bytes = std::stoull(arguments[3])};
  std::map<std::string, std::unique_ptr<ByteSource>> open;
  OpenByName files;
  if (!is_url(arguments[1])) {
    files = [folder = std::string(arguments[1])](const std::string& name) {
      return open_file(folder + "/" + name);
    };
  }
  for (std::string line; std::getline(std::cin, line);) {
    std::string answer;
    try {
      if (!files) files = files_at_url(arguments[1], options);
      std::istringstream words(line);
      answer = carry_out(words, files, open);
    } catch (const Error& error) {
      answer = std::string("error: ") + error.what();
    }
    std::cout << answer << std::endl;
  }
}
