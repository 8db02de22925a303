// SPDX-License-Identifier: GPL-3.0-or-later
#include "output.hpp"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <vector>

#include "terrace/stream/error.hpp"

namespace terrace::tools {
namespace {

/// A mark stands within so many bytes of the begin or the end.
constexpr std::streamoff kSearched = 64 << 10;

bool has_mark(std::string_view bytes) { return bytes.find("terrace") != std::string_view::npos; }

/// Lines of numbers, after at most one line of column names.
bool is_number_table(std::string_view bytes, bool whole_file) {
  if (!whole_file) bytes = bytes.substr(0, bytes.rfind('\n') + 1);  // the last line may be torn
  const std::size_t first_end = std::min(bytes.find('\n'), bytes.size());
  const auto is_number_char = [](char c) {
    return std::string_view("0123456789+-.eE,; \t\r\n").find(c) != std::string_view::npos ||
           std::string_view("naifNAIF").find(c) != std::string_view::npos;
  };
  const auto is_name_char = [&](char c) {
    return is_number_char(c) || std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' ||
           c == '#' || c == '"';
  };
  // A first line of names needs numbers below it; alone it may be a letter's.
  const bool names = !std::all_of(
      bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(first_end), is_number_char);
  const std::string_view head = bytes.substr(0, first_end);
  const std::string_view body = bytes.substr(first_end);
  if (names && body.find_first_of("0123456789") == std::string_view::npos) return false;
  return std::all_of(head.begin(), head.end(), is_name_char) &&
         std::all_of(body.begin(), body.end(), is_number_char);
}

}  // namespace

bool written_by_terrace(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return false;
  file.seekg(0, std::ios::end);
  const std::streamoff size = file.tellg();
  if (size <= 0) return size == 0;
  const std::streamoff part = std::min(size, kSearched);
  std::vector<char> bytes(static_cast<std::size_t>(part));
  const auto read_at = [&](std::streamoff offset) {
    file.seekg(offset);
    file.read(bytes.data(), part);
    return std::string_view(bytes.data(), static_cast<std::size_t>(file.gcount()));
  };
  if (has_mark(read_at(size - part))) return true;
  const std::string_view head = read_at(0);
  return has_mark(head) || is_number_table(head, part == size);
}

bool may_replace(const std::string& path, bool force) {
  namespace fs = std::filesystem;
  if (path == "-") return false;
  std::error_code ignored;
  const fs::file_status status = fs::symlink_status(path, ignored);
  if (!fs::exists(status)) return false;
  const auto refuse = [&](const std::string& cause, const std::string& remedy) {
    throw stream::Error({.file = path, .where = {}, .cause = cause, .remedy = remedy});
  };
  if (!force) refuse("exists already", "name another output, or give --force to replace it");
  if (!fs::is_regular_file(status)) refuse("is not a regular file", "name another output");
  if (!written_by_terrace(path)) {
    refuse("was not written by terrace, so --force does not replace it",
           "remove it yourself or name another output");
  }
  return true;
}

}  // namespace terrace::tools
