// SPDX-License-Identifier: Apache-2.0
#include "earth/crs/proj_object.hpp"

#include <array>
#include <new>
#include <string_view>
#include <utility>

#include "earth/crs/definition.hpp"

namespace terrace::terrain {
namespace {

thread_local std::string complaint;
thread_local std::string database_failure;

/// Whether PROJ's message is about its database: a failed read, or a missing file.
bool is_of_database(std::string_view message) {
  return message.find("SQLite error") != message.npos || message.find("proj.db") != message.npos;
}

/// Keeps the message, which PROJ would otherwise write to standard error.
void keep_message(void*, int level, const char* message) {
  if (level != PJ_LOG_ERROR || message == nullptr) return;
  complaint = message;
  if (database_failure.empty() && is_of_database(message)) database_failure = message;
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
  thread_local const ThreadContext thread_context;
  check_proj_database();
  if (proj_context_get_database_path(thread_context.context) == nullptr) {
    if (database_failure.empty()) database_failure = "Cannot find proj.db";
    check_proj_database();
  }
  return thread_context.context;
}

void check_proj_database() {
  const std::string reason = std::exchange(database_failure, {});
  if (reason.empty()) return;
  if (reason.find("Cannot find") != reason.npos) {
    throw CrsDatabaseError(
        {.file = "proj.db",
         .cause = "PROJ's database of reference systems is not found",
         .remedy = "install it (Debian's package proj-data), or name its folder in PROJ_DATA"});
  }
  throw CrsDatabaseError(
      {.file = "proj.db",
       .cause = "PROJ's database of reference systems cannot be read (" + reason + ")",
       .remedy = "check the disk it is on, and how many files a process may open"});
}

std::string proj_complaint() { return std::exchange(complaint, {}); }

ProjObject proj_crs_of_code(const std::string& authority, const std::string& code) {
  ProjObject object(proj_create_from_database(proj_context(), authority.c_str(), code.c_str(),
                                              PJ_CATEGORY_CRS, 0, nullptr));
  check_proj_database();
  return object;
}

ProjObject proj_crs_of_text(const std::string& text) {
  PJ_CONTEXT* const context = proj_context();
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  if (first == std::string::npos) return nullptr;
  if (text[first] == '{' || text[first] == '+') {
    ProjObject object(proj_create(context, text.c_str()));
    check_proj_database();
    return object;
  }
  const std::array<const char*, 2> options{"STRICT=NO", nullptr};
  PROJ_STRING_LIST warnings = nullptr, errors = nullptr;
  ProjObject object(
      proj_create_from_wkt(context, text.c_str() + first, options.data(), &warnings, &errors));
  if (errors != nullptr && errors[0] != nullptr && object == nullptr) complaint = errors[0];
  proj_string_list_destroy(warnings);
  proj_string_list_destroy(errors);
  check_proj_database();
  return object;
}

std::string wkt_of(const PJ* object) {
  const std::array<const char*, 2> options{"MULTILINE=NO", nullptr};
  std::string text = text_of(proj_as_wkt(proj_context(), object, PJ_WKT2_2019, options.data()));
  check_proj_database();
  return text;
}

}  // namespace terrace::terrain
