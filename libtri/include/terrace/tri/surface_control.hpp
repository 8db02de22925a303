// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <span>

#include "terrace/tri/surface_front.hpp"
#include "terrace/tri/view.hpp"

namespace terrace::tri {

/// Level of detail by view for a surface that was restored once: a SurfaceFront that follows a
/// camera under budgets of points and time.
///
/// A vertex is wanted if the error of the surface without it (VertexTree::errors) is above what the
/// view tolerates at the nearest point of a box around the vertex, those that move onto it, and
/// their neighbours on the full surface. A vertex in a View::focuses is wanted if its level
/// (VertexTree::levels) is the focus's or above. The parent of a wanted vertex is wanted.
///
/// With a view that does not change and sufficient budgets, steps converge to
///     { v : want(v) > 1 }  and  { v in S : keep(v) >= ViewOptions::collapse_below },
/// where S are the active vertices, and want and keep are as in ViewControl. If these would be more
/// than ViewOptions::max_points, the tolerance is raised until they are not, for all vertices by
/// the same factor; the vertices that are in every cut remain.
///
/// Uniform errors (View::ground_error alone, collapse_below 1) are bounds of the distance between
/// the surface shown and the full one. Where the detail varies they are estimates: the surface is
/// still without tears, but distances were measured for uniform cuts only.
///
/// Cost of a step: O(blocks of 128 vertices + vertices of the blocks in which any is active or
/// wanted + changes). Memory besides the front: 90 bytes per vertex.
class SurfaceControl {
 public:
  /// The result of a step, valid until the next.
  struct Step {
    const SurfaceFront::Changes* changes = nullptr;
    std::size_t activated = 0, deactivated = 0;  ///< vertices
    /// Wanted vertices that are not active. pending: the step's budget was spent. blocked: no room
    /// under max_points.
    std::size_t pending = 0, blocked = 0;
    /// The greatest demand among these. If it is at most 1, the view is as detailed as it should
    /// be.
    double worst = 0.0;
    /// True if another step with the same view would change nothing.
    bool settled = false;
  };

  /// Of the options, collapse_below, guard and max_points count. Throws: std::invalid_argument for
  /// options out of range, and as SurfaceFront.
  SurfaceControl(const Surface& surface, const VertexTree& tree, const ViewOptions& options = {});
  ~SurfaceControl();
  SurfaceControl(const SurfaceControl&) = delete;
  SurfaceControl& operator=(const SurfaceControl&) = delete;

  [[nodiscard]] const SurfaceFront& front() const;

  /// Brings the surface closer to the view. An operation of the budget is the change of up to 32
  /// vertices. Throws: as ViewControl::step().
  const Step& step(const View& view, const StepBudget& budget = {});

  /// Overrides the view, in place of earlier calls: the vertices `active`, with their ancestors,
  /// are wanted, and the vertices `inactive`, with their descendants, are not. Where both apply,
  /// the vertex is not. A vertex that is in every cut remains. O(n).
  void pin(std::span<const VertexId> active, std::span<const VertexId> inactive);

  /// Memory in bytes besides the front.
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace terrace::tri
