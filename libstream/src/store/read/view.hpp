// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "terrace/stream/store.hpp"

namespace terrace::stream {

/// The condition of a view and its bounds. An interface, so that programs without views contain
/// neither conditions nor the search for bounds. Several threads may call const members at once.
class Store::View {
 public:
  View() = default;
  virtual ~View() = default;
  View(const View&) = delete;
  View& operator=(const View&) = delete;

  [[nodiscard]] virtual const Where& condition() const = 0;
  virtual void mark(ClusterPoints& points) const = 0;
  /// view: the store itself, with its stop token.
  [[nodiscard]] virtual bool may_match(const Store& view, ClusterId id) const = 0;
  [[nodiscard]] virtual const Box3& bounds(const Store& view) const = 0;
};

}  // namespace terrace::stream
