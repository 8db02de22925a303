// SPDX-License-Identifier: Apache-2.0
#include "earth/crs/proj_object.hpp"

#include <array>
#include <new>
#include <utility>

#include "earth/crs/crs_definition.hpp"

namespace terrace::terrain {
namespace {

thread_local std::string complaint;

/// PROJ would write to standard error.
void keep_message(void*, int level, const char* message) {
  if (level == PJ_LOG_ERROR && message != nullptr) complaint = message;
}

struct ThreadContext {
  PJ_CONTEXT* context = make_proj_context();
  ThreadContext() = default;
  ThreadContext(const ThreadContext&) = delete;
  ThreadContext& operator=(const ThreadContext&) = delete;
  ~ThreadContext() { proj_context_destroy(context); }
};

}  // namespace

PJ_CONTEXT* make_proj_context() {
  PJ_CONTEXT* const context = proj_context_create();
  if (context == nullptr) throw std::bad_alloc();
  proj_log_func(context, nullptr, keep_message);
  proj_log_level(context, PJ_LOG_ERROR);
  proj_context_set_enable_network(context, 0);
  return context;
}

PJ_CONTEXT* proj_context() {
  thread_local const ThreadContext own;
  if (proj_context_get_database_path(own.context) == nullptr) {
    throw CrsError("PROJ's database of reference systems, proj.db, is not found",
                   "install it (Debian's package proj-data), or name its folder in PROJ_DATA");
  }
  return own.context;
}

std::string proj_complaint() { return std::exchange(complaint, {}); }

ProjObject proj_crs_of_code(const std::string& authority, const std::string& code) {
  return ProjObject(proj_create_from_database(proj_context(), authority.c_str(), code.c_str(),
                                              PJ_CATEGORY_CRS, 0, nullptr));
}

ProjObject proj_crs_of_text(const std::string& text) {
  PJ_CONTEXT* const context = proj_context();
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  if (first == std::string::npos) return nullptr;
  if (text[first] == '{' || text[first] == '+')
    return ProjObject(proj_create(context, text.c_str()));
  const std::array<const char*, 2> options{"STRICT=NO", nullptr};
  PROJ_STRING_LIST warnings = nullptr, errors = nullptr;
  ProjObject object(
      proj_create_from_wkt(context, text.c_str() + first, options.data(), &warnings, &errors));
  if (errors != nullptr && errors[0] != nullptr && object == nullptr) complaint = errors[0];
  proj_string_list_destroy(warnings);
  proj_string_list_destroy(errors);
  return object;
}

std::string wkt_of(const PJ* object) {
  const std::array<const char*, 2> options{"MULTILINE=NO", nullptr};
  return text_of(proj_as_wkt(proj_context(), object, PJ_WKT2_2019, options.data()));
}

}  // namespace terrace::terrain
