// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include <terrace/stream/store.hpp>
#include <terrace/stream/store_query.hpp>
#include <terrace/terrain/crs.hpp>
#include <terrace/terrain/detail.hpp>
#include <terrace/tri/multiresolution.hpp>

#include "core.hpp"

namespace terrace::python {

/// A store opened by Python, until it is closed.
class OpenStore {
 public:
  explicit OpenStore(const std::string& path) : store_(stream::Store::open(path)) {}
  explicit OpenStore(const stream::Store& store) : store_(store) {}

  /// Returns a cheap copy, because another thread may close this store meanwhile.
  /// where: the condition of a view.
  /// Throws: ValueError once it is closed; terrace.Error for an invalid condition.
  [[nodiscard]] stream::Store get(const std::string& where = {}) const {
    if (!store_) throw py::value_error("the store is closed");
    return store_->where(where);
  }
  /// Returns a copy like get(). Throws: ValueError also for a view with a condition.
  [[nodiscard]] stream::Store get_whole() const {
    stream::Store store = get();
    if (store.condition() != nullptr) {
      throw py::value_error("views with a condition are not supported here: pass the store itself");
    }
    return store;
  }
  /// Closes the store. Running calls continue with the files that they hold.
  void close() { store_.reset(); }
  [[nodiscard]] bool closed() const { return !store_; }

 private:
  std::optional<stream::Store> store_;
};

/// Returns the detail of a level, a region and focuses (pairs of region and level).
/// Throws: ValueError for a level that the store does not have.
terrain::Detail detail_of(const stream::Store& store, unsigned level, const py::object& region,
                          const py::list& focuses);

/// Returns a cluster by its level and its number on that level.
/// Throws: ValueError for a cluster that the store does not have.
tri::ClusterId cluster_of(const stream::Store& store, unsigned level, std::uint64_t number);

/// Converts a point from the CRS to stored coordinates, and a box to the stored box around it.
stream::Point3 stored_point(const stream::Schema& schema, const stream::Point3& world);
stream::Box3 stored_box(const stream::Schema& schema, const stream::Box3& world);

/// Returns file, offset and description of a problem in one line.
std::string text_of(const stream::Problem& problem);

/// Returns the transformation to the CRS with a name, or nullopt for an empty name.
std::optional<terrain::Transformation> change_to(const stream::Store& store,
                                                 const std::string& crs);

}  // namespace terrace::python
