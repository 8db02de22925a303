// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include <proj.h>
// Needed to build a CRS from its parts; stable since PROJ 6, and GDAL uses it.
#include <proj_experimental.h>

/// PROJ's objects, which a function owns while it reads their definitions into plain data.
/// ProjPipeline converts coordinates.

namespace terrace::terrain {

struct ProjDestroy {
  void operator()(PJ* object) const { proj_destroy(object); }
  void operator()(PJ_OBJ_LIST* list) const { proj_list_destroy(list); }
  void operator()(PJ_OPERATION_FACTORY_CONTEXT* factory) const {
    proj_operation_factory_context_destroy(factory);
  }
};
template <class Thing>
using ProjOwned = std::unique_ptr<Thing, ProjDestroy>;
using ProjObject = ProjOwned<PJ>;

/// Returns PROJ's context of this thread, with its database open and the network off. Objects made
/// with it must not leave the thread. Throws: CrsDatabaseError if there is no database, and as
/// check_proj_database().
PJ_CONTEXT* proj_context();

/// Checks whether a read of the database failed. Call it after every function that reads the
/// database, because PROJ returns the same for a failed read as for an unknown name. Throws:
/// CrsDatabaseError if a read failed in this thread since the last call.
void check_proj_database();

/// Returns a context that never uses the network and keeps messages for proj_complaint().
PJ_CONTEXT* make_proj_context();

/// Returns and clears PROJ's last complaint in this thread; may be empty.
std::string proj_complaint();

/// Returns the object of a code; null if there is none. Throws: as proj_context().
ProjObject proj_crs_of_code(const std::string& authority, const std::string& code);
/// Reads WKT of any version, PROJJSON or a PROJ string; null for other text.
ProjObject proj_crs_of_text(const std::string& text);

/// Returns WKT 2:2019 on one line; empty if the object cannot be expressed in it.
std::string wkt_of(const PJ* object);

/// Returns "" for nullptr.
inline std::string text_of(const char* text) { return text == nullptr ? "" : text; }

}  // namespace terrace::terrain
