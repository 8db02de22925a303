// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <queue>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "shrinking_surface.hpp"

namespace terrace::tri::shape {

/// Restricts the collapses of a CollapseOrder and follows the vertices that wait in it.
class CollapseRule {
 public:
  CollapseRule() = default;
  virtual ~CollapseRule() = default;
  CollapseRule(const CollapseRule&) = delete;
  CollapseRule& operator=(const CollapseRule&) = delete;

  /// Whether the vertex may move onto this neighbour.
  [[nodiscard]] virtual bool allows(std::uint32_t /*vertex*/, std::uint32_t /*target*/) const {
    return true;
  }
  /// The vertex has an allowed collapse and waits for its turn, or no longer waits.
  virtual void waits(std::uint32_t /*vertex*/, bool /*waiting*/) {}
};

/// Collapses edges in the order of their errors. A vertex waits with an estimate of its error. When
/// its turn comes the error is measured, and if that is larger the vertex waits again with it,
/// until its turn or until one of its triangles changes. Then it waits with a new estimate, and so
/// does a vertex that had no allowed collapse.
class CollapseOrder {
 public:
  /// max_error: a collapse with a larger error is refused. All vertices wait at first. The rule
  /// must outlive the object.
  CollapseOrder(const Surface& surface, double max_error, CollapseRule& rule,
                base::StopCheck check_stop);

  struct Step {
    std::uint32_t vertex = 0, target = 0;
    double error = 0.0;  ///< the largest error of any step so far
  };
  /// Performs the next collapse; nullopt if no vertex waits with one that is allowed.
  std::optional<Step> next();
  /// Adds a vertex and its neighbours to those that wait, because the rule now allows more.
  void reconsider(std::uint32_t vertex);

  [[nodiscard]] const ShrinkingSurface& surface() const { return shrinking_; }

 private:
  struct Waiting {
    double error = 0.0;
    std::uint32_t vertex = 0;
    std::uint32_t turn = 0;
    bool operator>(const Waiting& other) const {
      return error != other.error ? error > other.error : vertex > other.vertex;
    }
  };
  enum class Wait : std::uint8_t { nothing, estimate, measured };
  struct Turn {
    std::uint32_t turn = 0;  ///< entries of the queue with another number do not count
    Wait with = Wait::nothing;
  };

  [[nodiscard]] ShrinkingSurface::Collapse cheapest(std::uint32_t vertex);
  void set_wait(std::uint32_t vertex, Wait with);
  void wait_with(std::uint32_t vertex, double error, Wait with);
  void wait(std::uint32_t vertex);

  CollapseRule& rule_;
  base::StopCheck check_stop_;
  SurfaceFrame frame_;
  double limit_;  ///< in local coordinates
  ShrinkingSurface shrinking_;
  std::vector<Turn> waits_;
  std::priority_queue<Waiting, std::vector<Waiting>, std::greater<>> queue_;
  double largest_ = 0.0;  ///< in local coordinates
  std::size_t turns_ = 0;
  std::vector<std::uint32_t> around_;
};

}  // namespace terrace::tri::shape
