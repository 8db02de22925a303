// SPDX-License-Identifier: Apache-2.0
#include "store/read/level_reader.hpp"

#include <string>

#include "terrace/stream/error.hpp"

namespace terrace::stream::store {
namespace {

/// Segments of a level to keep open; each has two files and its cached pages.
constexpr std::size_t kOpenSegments = 64;

}  // namespace

LevelReader::LevelReader(const OpenByName& files, const Manifest& manifest, unsigned level)
    : manifest_(manifest),
      layout_(manifest.schema, level),
      firsts_{0},
      open_(std::min(kOpenSegments, manifest.levels[level].segments.size())) {
  const std::vector<SegmentEntry>& segments = manifest.levels[level].segments;
  for (const SegmentEntry& segment : segments) {
    firsts_.push_back(firsts_.back() + segment.clusters);
  }
  if (segments.size() == 1) {
    only_ = std::make_unique<const SegmentReader>(files, manifest, level, segments.front(), 0);
  } else {
    files_ = files;
  }
}

auto LevelReader::segment(std::size_t number) const -> Handle {
  if (only_ != nullptr) return Handle(*only_);
  return Handle(open_.get(number, [&] {
    return std::make_shared<const SegmentReader>(files_, manifest_, layout_.level,
                                                 manifest_.levels[layout_.level].segments[number],
                                                 firsts_[number]);
  }));
}

auto LevelReader::find(std::uint64_t ordinal) const -> Place {
  if (ordinal >= clusters()) {
    throw Error(segment(0)->index().name(), "there is no cluster " + std::to_string(layout_.level) +
                                                "/" + std::to_string(ordinal) + ", the level has " +
                                                std::to_string(clusters()));
  }
  if (only_ != nullptr) return {Handle(*only_), ordinal};
  const std::size_t number = segment_of(ordinal);
  return {segment(number), ordinal - firsts_[number]};
}

}  // namespace terrace::stream::store
