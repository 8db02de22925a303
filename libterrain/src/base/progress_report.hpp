// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <utility>

#include "terrace/terrain/context.hpp"

namespace terrace::terrain {

/// Reports the progress of one task to its context; the destructor reports its end.
class ProgressReport {
 public:
  /// what: the things counted, such as "points". The context must outlive the report.
  ProgressReport(const Context& context, std::string what)
      : context_(context), what_(std::move(what)) {}
  ~ProgressReport() {
    try {
      report({.what = what_, .ended = true});
    } catch (...) {  // NOLINT(bugprone-empty-catch): the work is over
    }
  }
  ProgressReport(const ProgressReport&) = delete;
  ProgressReport& operator=(const ProgressReport&) = delete;

  /// count: items completed. fraction: share of the work completed, 0 to 1; 0 if unknown.
  void update(std::uint64_t count, double fraction) const {
    report({.what = what_, .count = count, .fraction = fraction});
  }

 private:
  void report(const Progress& progress) const {
    if (context_.progress) context_.progress(progress);
  }

  const Context& context_;
  std::string what_;
};

}  // namespace terrace::terrain
