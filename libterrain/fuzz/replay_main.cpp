// SPDX-License-Identifier: Apache-2.0
// Runs a fuzz target over the files of a corpus folder, so that the target compiles everywhere and
// every input that once failed stays tested. A file with a name that starts with "good" must be
// accepted, any other must be refused; otherwise a target that refuses everything would find
// nothing.
#include <fstream>
#include <iterator>
#include <vector>

#include "fuzz_target.hpp"

int main(int argc, char** argv) {
  std::size_t good = 0, bad = 0, wrong = 0;
  for (int i = 1; i < argc; ++i) {
    for (const auto& entry : std::filesystem::recursive_directory_iterator(argv[i])) {
      if (!entry.is_regular_file()) continue;
      std::ifstream file(entry.path(), std::ios::binary);
      const std::vector<char> bytes{std::istreambuf_iterator<char>(file), {}};
      const terrace::terrain::fuzz::WorkLimit limit(bytes.size());
      const bool due = entry.path().filename().string().starts_with("good");
      const bool accepted = terrace::terrain::fuzz::accepts(
          reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
      ++(due ? good : bad);
      if (accepted == due) continue;
      std::printf("%s was %s\n", entry.path().c_str(), accepted ? "accepted" : "refused");
      ++wrong;
    }
  }
  std::printf("%zu good and %zu bad inputs replayed\n", good, bad);
  return good == 0 || bad == 0 || wrong > 0 ? 1 : 0;
}
