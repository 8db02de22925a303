// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <system_error>

#include "fuzz_points.hpp"

namespace {

/// A folder for the files of one dataset, which is removed at the end of the process.
class Folder {
 public:
  Folder() {
    std::string name = (std::filesystem::temp_directory_path() / "terrace-fuzz-XXXXXX").string();
    terrace::stream::require(mkdtemp(name.data()) != nullptr, "a folder can be created");
    path_ = name;
    for (const char* inner : {"ept-data", "ept-hierarchy"}) {
      std::filesystem::create_directory(path_ / inner);
    }
  }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  std::string write(const char* name, std::string_view bytes) const {
    std::ofstream file(path_ / name, std::ios::binary);
    file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    return (path_ / name).string();
  }

 private:
  std::filesystem::path path_;
};

}  // namespace

/// Any input is read as a dataset or refused. The input is ept.json, two files of the hierarchy,
/// and the points for each of the three encodings, separated by zero bytes.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace terrace::stream;
  static const Folder folder;
  WorkLimit limit(size);
  std::string_view rest(reinterpret_cast<const char*>(data), size);
  const auto next = [&rest] {
    const std::string_view part = rest.substr(0, rest.find('\0'));
    rest.remove_prefix(std::min(part.size() + 1, rest.size()));
    return part;
  };
  const std::string file = folder.write("ept.json", next());
  folder.write("ept-hierarchy/0-0-0-0.json", next());
  folder.write("ept-hierarchy/1-0-0-0.json", next());
  for (const char* ending : {"bin", "zst", "laz"}) {
    folder.write((std::string("ept-data/0-0-0-0.") + ending).c_str(), rest);
    folder.write((std::string("ept-data/1-0-0-0.") + ending).c_str(), rest);
  }
  const ReadResult large = read_all_points(file, {.format = "ept", .block_points = 500});
  limit.add(large.points);
  const ReadResult small = read_all_points(file, {.format = "ept", .block_points = 3});
  require(large == small, "points do not depend on the block size");
  const ReadResult threads =
      read_all_points(file, {.format = "ept", .block_points = 500, .threads = 2});
  require(large == threads, "points do not depend on the threads");
  return 0;
}
