// SPDX-License-Identifier: GPL-3.0-or-later
// Tables as text. The first line names the kind of table and, where it matters, the number of
// points: "places", "labels 5", "dendrogram", "matching 5".
#include <charconv>
#include <cmath>

#include "fuzz_target.hpp"
#include "sample/place_file.hpp"
#include "tables/dendrogram_file.hpp"
#include "tables/label_file.hpp"
#include "tables/matching_result.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::terrain::fuzz {

using namespace tools;

namespace {

/// Reads a table as `sample` does. Returns true if it contained a place.
bool read_places(const std::string& path) {
  PlaceFile file(path);
  PlaceBatch batch;
  std::optional<PlaceLayout> layout;
  std::uint64_t due = 1, places = 0;
  std::string out;
  while (file.next(batch, 64, 3)) {
    require(batch.size() > 0 && batch.first_line == due, "lines follow one another");
    due += batch.size();
    for (std::size_t i = 0; i < batch.size(); ++i) {
      const std::string_view line = batch.line(i);
      if (is_skipped_line(line)) continue;
      if (!layout) {
        layout = PlaceLayout::of(line, file.name());
        if (layout->header) continue;
      }
      static_cast<void>(place_of(line, *layout, file.name(), batch.first_line + i));
      ++places;
      out.clear();
      append_with_place(out, line, *layout, "1", "2");
      require(out.size() <= line.size() + 4, "a line with its place replaced");
    }
  }
  return places > 0;
}

bool read_tree(const std::string& path) {
  const std::optional<cluster::Dendrogram> dendrogram = read_dendrogram(path);
  if (!dendrogram) return false;
  require(dendrogram->points == dendrogram->merges.size() + 1, "one merge fewer than points");
  for (std::size_t r = 0; r < dendrogram->merges.size(); ++r) {
    const cluster::Merge& merge = dendrogram->merges[r];
    const std::size_t nodes = dendrogram->points + r;
    require(merge.a < nodes && merge.b < nodes && merge.a != merge.b, "children before parents");
    require(merge.size >= 2 && merge.size <= dendrogram->points, "sizes of clusters");
  }
  static_cast<void>(cluster::cut_count(*dendrogram, 2));
  return true;
}

bool read_matching(const std::string& path, std::size_t points) {
  static_cast<void>(is_matching_result(path));
  const MatchingResult result = read_matching_result(path, points);
  require(result.points == points, "the number of points");
  for (std::size_t r = 0; r < result.lines.size(); ++r) {
    const MatchingLine& line = result.lines[r];
    const std::size_t nodes = result.tree ? points + r : points;
    require(line.a < nodes && line.b < nodes && line.a != line.b, "children before parents");
    require(line.level >= 1 && line.level <= result.top, "levels");
  }
  return true;
}

}  // namespace

bool accepts(const std::uint8_t* data, std::size_t size) {
  std::string_view text = text_of(data, size);
  const std::string_view head = take_line(text);
  const std::string_view kind = head.substr(0, head.find(' '));
  std::uint16_t points = 0;
  if (kind.size() < head.size()) {
    std::from_chars(head.data() + kind.size() + 1, head.data() + head.size(), points);
  }
  const MemoryFile file(text);
  try {
    if (kind == "places") return read_places(file.name());
    if (kind == "labels") return read_labels(file.name(), points).size() == points;
    if (kind == "dendrogram") return read_tree(file.name());
    if (kind == "matching") return read_matching(file.name(), points);
  } catch (const stream::Error& error) {
    require(!error.parts().cause.empty(), "a cause");
  }
  return false;
}

}  // namespace terrace::terrain::fuzz
