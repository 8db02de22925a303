// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iterator>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "terrace/stream/error.hpp"
#include "terrace/stream/store.hpp"
#include "terrace/stream/store_query.hpp"

/// reader_alone STORE reads a store through functions, as from a server, linked only with the
/// reader's library. Exit status 0 if the store is valid and a query finds all points.

int main(int arguments, char** values) {
  using namespace terrace::stream;
  if (arguments != 2) return 2;
  const std::string folder = values[1];
  std::size_t requests = 0;
  const OpenByName files = [&](const std::string& name) {
    std::ifstream in(folder + "/" + name, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(in), {}};
    return bytes_by_function("store://" + name, bytes.size(),
                             [&requests, bytes](std::uint64_t offset, std::span<std::byte> out) {
                               ++requests;
                               std::memcpy(out.data(), bytes.data() + offset, out.size());
                             });
  };
  try {
    const Store store = Store::open("store:/", files);
    const bool sound = store.verify([](const Problem& problem) {
      std::fprintf(stderr, "%s: %s\n", problem.file.c_str(), problem.what.c_str());
    });
    const auto points = StoreQuery(store).in_box(store.bounds());
    std::printf("%zu points by %zu requests\n", points.size(), requests);
    return sound && points.size() == store.points() ? 0 : 1;
  } catch (const Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
