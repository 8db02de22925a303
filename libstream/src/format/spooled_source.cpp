// SPDX-License-Identifier: Apache-2.0
#include "format/spooled_source.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "io/peek.hpp"
#include "io/spool.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/input.hpp"

namespace terrace::stream {
namespace {

constexpr std::size_t kCopyBytes = std::size_t{256} << 10;

class SpooledSource final : public PointSource {
 public:
  SpooledSource(const Format& format, std::span<const std::string> files,
                const SourceOptions& options)
      : names_(files.begin(), files.end()), copies_(files.begin(), files.end()) {
    for (std::size_t i = 0; i < names_.size(); ++i) {
      if (!is_seekable(names_[i])) copies_[i] = set_aside(names_[i], options.stop);
    }
    with_names([&] { source_ = format.open(copies_, options); });
    info_ = source_->info();
    for (std::string& file : info_.files) file = name_of_copy(file);
    for (const auto& spool : spools_) info_.spooled_bytes += spool->size();
  }

  const SourceInfo& info() const override { return info_; }
  bool next(PointBlock& block) override {
    bool more = false;
    with_names([&] { more = source_->next(block); });
    return more;
  }
  Progress progress() const override { return source_->progress(); }
  void refine(double cell_aspect, std::uint64_t memory_bytes) override {
    with_names([&] { source_->refine(cell_aspect, memory_bytes); });
  }
  std::uint64_t reading_bytes() const override { return source_->reading_bytes(); }

 private:
  /// Copies a file to a temporary one; returns the name by which that can be opened.
  std::string set_aside(const std::string& file, const std::stop_token& stop) {
    Input input(file, stop);
    auto spool = std::make_unique<Spool>(input.name());
    while (!input.fill(kCopyBytes).empty()) {
      spool->append(std::as_bytes(std::span(input.window())));
      input.consume(input.window().size());
    }
    spools_.push_back(std::move(spool));
    return spools_.back()->path();
  }

  std::string name_of_copy(const std::string& file) const {
    const auto at = std::find(copies_.begin(), copies_.end(), file);
    if (at == copies_.end()) return file;
    const std::string& name = names_[static_cast<std::size_t>(at - copies_.begin())];
    return name == kStandardStream ? "standard input" : name;
  }

  template <class Do>
  void with_names(const Do& work) const {
    try {
      work();
    } catch (const Error& error) {
      Error::Parts parts = error.parts();
      parts.file = name_of_copy(parts.file);
      throw Error(std::move(parts));
    }
  }

  std::vector<std::string> names_, copies_;
  std::vector<std::unique_ptr<Spool>> spools_;
  std::unique_ptr<PointSource> source_;  // destroyed before the copies that it reads
  SourceInfo info_;
};

}  // namespace

std::unique_ptr<PointSource> open_spooled(const Format& format, std::span<const std::string> files,
                                          const SourceOptions& options) {
  return std::make_unique<SpooledSource>(format, files, options);
}

}  // namespace terrace::stream
