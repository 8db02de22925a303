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

/// A store as Python holds it: open until it is closed.
class OpenStore {
 public:
  explicit OpenStore(const std::string& path) : store_(stream::Store::open(path)) {}
  explicit OpenStore(const stream::Store& store) : store_(store) {}

  /// A copy, which is cheap: another thread may close this store meanwhile. where: the condition of
  /// a view. Throws: ValueError once it is closed; terrace.Error for a bad condition.
  [[nodiscard]] stream::Store get(const std::string& where = {}) const {
    if (!store_) throw py::value_error("the store is closed");
    return store_->where(where);
  }
  /// Throws: ValueError for a view, too.
  [[nodiscard]] stream::Store get_whole() const {
    stream::Store store = get();
    if (store.condition() != nullptr) {
      throw py::value_error(
          "it has all points of a store, and no condition: give the store itself");
    }
    return store;
  }
  /// Work under way goes on with the files that it has.
  void close() { store_.reset(); }
  [[nodiscard]] bool closed() const { return !store_; }

 private:
  std::optional<stream::Store> store_;
};

/// level, region and focuses (pairs of region and level).
/// Throws: ValueError for a level that the store does not have.
terrain::Detail detail_of(const stream::Store& store, unsigned level, const py::object& region,
                          const py::list& focuses);

/// A cluster by its level and its number there. Throws: ValueError for one that the store does not
/// have.
tri::ClusterId cluster_of(const stream::Store& store, unsigned level, std::uint64_t number);

/// Stored coordinates of a point in the CRS, and those around a box of it.
stream::Point3 stored_point(const stream::Schema& schema, const stream::Point3& world);
stream::Box3 stored_box(const stream::Schema& schema, const stream::Box3& world);

/// File, place and what is wrong there.
std::string text_of(const stream::Problem& problem);

/// To the CRS of that name; nullopt for an empty one.
std::optional<terrain::Transformation> change_to(const stream::Store& store,
                                                 const std::string& crs);

}  // namespace terrace::python
