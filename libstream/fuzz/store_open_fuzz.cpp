// SPDX-License-Identifier: Apache-2.0
// A complete store: Store::open, all ways to read it, and verify. Its checksums are recomputed
// first, to test the code after them. The input is one file after another: two bytes for the length
// of the name, the name, four bytes for the number of bytes, the bytes.
#include <cmath>
#include <cstdlib>
#include <optional>
#include <string_view>

#include "../tests/store_editing.hpp"
#include "fuzz_points.hpp"
#include "terrace/stream/store.hpp"
#include "terrace/stream/store_query.hpp"

namespace {

using namespace terrace::stream;
namespace fs = std::filesystem;

/// One folder for the lifetime of the process.
class Folder {
 public:
  Folder() {
    std::string name = (fs::temp_directory_path() / "terrace-fuzz-XXXXXX").string();
    require(mkdtemp(name.data()) != nullptr, "a temporary folder can be created");
    path_ = name;
  }
  ~Folder() { fs::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  [[nodiscard]] const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

testing::StoreFiles files_of(std::string_view input) {
  testing::StoreFiles files;
  const auto take = [&input](std::size_t size) {
    const std::string_view part = input.substr(0, size);
    input.remove_prefix(part.size());
    return std::string(part);
  };
  const auto number = [&take](std::size_t bytes) {
    std::uint32_t value = 0;
    const std::string part = take(bytes);
    std::memcpy(&value, part.data(), part.size());
    return value;
  };
  while (!input.empty() && files.size() < 32) {
    const std::string name = take(number(2) % 64);
    const std::string bytes = take(number(4));
    if (!name.empty() && name[0] != '.' && name.find_first_of(std::string("/\0", 2)) == name.npos) {
      files[name] = bytes;
    }
  }
  return files;
}

/// The guarantees of Store for any store that opens.
class Promises {
 public:
  explicit Promises(const Store& store) : store_(store) {}

  void check_cluster(ClusterId id, const ClusterRecord& record, const ClusterPoints& points) {
    const unsigned level = level_of(id);
    require(points.size() == record.points, "members agree with the index");
    require(points.has_representative == (id != store_.root()),
            "all clusters but the root have a representative");
    require(points.payload.size() == points.size() * store_.schema().payload_size(),
            "every member has attributes");
    require(points.children.size() == points.size() * level, "every member has children");
    for (const Point3& p : points.positions) check_point(p, record);
    if (points.has_representative) check_point(points.representative, record);
    for (std::size_t i = 0; i < points.children.size(); ++i) {
      require(points.children[i] < store_.levels()[i % level].clusters, "children exist");
    }
    for (std::size_t j = 0; j < points.representative_children.size(); ++j) {
      require(points.representative_children[j] < store_.levels()[j].clusters, "children exist");
    }
  }

 private:
  void check_point(const Point3& p, const ClusterRecord& record) {
    const StoreSchema& schema = store_.schema();
    require(record.summary.box.contains(p), "points are in the cluster's box");
    require(store_.bounds().contains(p), "points are in the bounds");
    if (!schema.grid) return;
    require(p[0] == std::floor(p[0]) && p[1] == std::floor(p[1]), "columns and rows are integers");
    require(p[0] >= 0 && p[0] < static_cast<double>(schema.columns), "columns are in the raster");
    require(p[1] >= 0 && p[1] < static_cast<double>(schema.rows), "rows are in the raster");
  }

  const Store& store_;
};

void read_all(const Store& store) {
  Promises promises(store);
  bool readable = true;
  for (const LevelInfo& level : store.levels()) {
    std::uint64_t members = 0;
    try {
      store.for_each(level.level,
                     [&](ClusterId id, const ClusterRecord& record, const ClusterPoints& points) {
                       promises.check_cluster(id, record, points);
                       members += points.size();
                       require(members <= level.members, "members do not exceed the manifest's");
                     });
      require(members == level.members, "members agree with the manifest");
    } catch (const Error&) {
      readable = false;
    }
  }
  // One by one in reverse, so that the readable parts of a damaged store are read.
  ClusterPoints points;
  for (const LevelInfo& level : store.levels()) {
    for (std::uint64_t i = std::min<std::uint64_t>(level.clusters, 300); i-- > 0;) {
      const ClusterId id = cluster_id(level.level, level.clusters - 1 - i);
      try {
        const ClusterRecord record = store.record(id);
        store.read(id, points);
        promises.check_cluster(id, record, points);
      } catch (const Error&) {
        readable = false;
      }
    }
  }
  // Queries end whatever the hierarchy contains, and find all points of an intact store.
  std::optional<std::uint64_t> counted;
  try {
    StoreQuery query(store);
    const std::uint64_t found = query.in_box(store.bounds()).size();
    counted = query.count(store.bounds());
    require(!(query.estimate(store.bounds()) < 0), "estimates are not negative");
    require(
        query.nearest(store.bounds().min, 3).size() == std::min<std::uint64_t>(3, store.points()) ||
            found != store.points(),
        "nearest points are found");
    require(query.within(store.bounds().max, 1).size() <= store.points(),
            "points within a radius are points of the store");
    if (found != store.points()) readable = false;
  } catch (const Error&) {
    readable = false;
  }
  std::size_t problems = 0;
  const bool good = store.verify([&problems](const Problem& problem) {
    require(!problem.file.empty() && !problem.what.empty(), "a problem has a place and a cause");
    ++problems;
  });
  require(good == (problems == 0), "verify() returns whether there were problems");
  require(!good || readable, "a sound store can be read");
  require(!good || counted == store.points(), "a sound store is counted completely");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Folder folder;
  testing::StoreFiles files = files_of({reinterpret_cast<const char*>(data), size});
  testing::update_checksums(files);
  testing::write_files(folder.path(), files);
  try {
    read_all(Store::open(folder.path()));
  } catch (const Error& error) {
    require(!error.parts().cause.empty(), "errors have a cause");
  }
  for (const auto& [name, bytes] : files) fs::remove(folder.path() / name);
  return 0;
}
