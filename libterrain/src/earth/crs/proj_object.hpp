// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include <proj.h>
// Building a CRS from its parts; stable since PROJ 6, GDAL uses it.
#include <proj_experimental.h>

/// PROJ's objects, as long as one function needs them: definitions are read from them into plain
/// data. Coordinates go through ProjPipeline.

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

/// PROJ's context of this thread, with its database open and the network off. Nothing made with it
/// may leave the thread. Throws: CrsDatabaseError if there is no database, and as
/// check_proj_database().
PJ_CONTEXT* proj_context();

/// To be called after what reads the database: PROJ returns the same for a failed read as for an
/// unknown name. Throws: CrsDatabaseError if a read failed in this thread since the last call.
void check_proj_database();

/// A context that never uses the network and keeps messages for proj_complaint().
PJ_CONTEXT* make_proj_context();

/// What PROJ last complained about in this thread, since it was asked; may be empty.
std::string proj_complaint();

/// The object of that code. nullptr if there is none. Throws: as proj_context.
ProjObject proj_crs_of_code(const std::string& authority, const std::string& code);
/// From WKT of any version, PROJJSON or a PROJ string. nullptr if it is none of them.
ProjObject proj_crs_of_text(const std::string& text);

/// WKT 2:2019 in one line; empty if the object cannot be written so.
std::string wkt_of(const PJ* object);

/// "" instead of nullptr.
inline std::string text_of(const char* text) { return text == nullptr ? "" : text; }

}  // namespace terrace::terrain
