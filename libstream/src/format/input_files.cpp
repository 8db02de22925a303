// SPDX-License-Identifier: Apache-2.0
#include "format/input_files.hpp"

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <string_view>
#include <system_error>
#include <utility>

#include <glob.h>

#include "format/ept/metadata.hpp"
#include "format/registry.hpp"
#include "io/line_reader.hpp"
#include "io/temporary.hpp"
#include "io/text.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/input.hpp"
#include "terrace/stream/network.hpp"

namespace terrace::stream {
namespace {

namespace fs = std::filesystem;

bool exists(const std::string& name) {
  std::error_code ignored;
  return fs::exists(fs::symlink_status(name, ignored));
}

/// Appends all files below the folder whose names show a known format, sorted by path.
void add_folder(const std::string& folder, const std::string& format,
                std::vector<std::string>& files) {
  const std::size_t before = files.size();
  std::error_code error;
  fs::recursive_directory_iterator at(folder, error);
  for (; !error && at != fs::recursive_directory_iterator(); at.increment(error)) {
    std::error_code ignored;
    // An EPT folder is one input; the files in it are not inputs themselves.
    if (at->is_directory(ignored) && fs::exists(at->path() / kEptName, ignored)) {
      at.disable_recursion_pending();
      if (format.empty() || format == "ept") files.push_back((at->path() / kEptName).string());
      continue;
    }
    const Format* const file_format = format_of_name(at->path().string());
    const bool hidden = at->path().filename().string().front() == '.';
    if (hidden || file_format == nullptr || (!format.empty() && file_format->name != format) ||
        !at->is_regular_file(ignored)) {
      continue;
    }
    files.push_back(at->path().string());
  }
  if (error) throw Error(folder, "cannot be listed: " + error.message());
  if (files.size() == before) {
    if (exists((fs::path(folder) / kManifestName).string())) {
      throw Error(folder, "is a store, not a file of points")
          .remedy("write its points to a file first, with 'terrace points'");
    }
    throw Error(folder, "is a folder without a file that can be read")
        .remedy("name a folder with files that end in .las, .tif or similar");
  }
  std::sort(files.begin() + static_cast<std::ptrdiff_t>(before), files.end());
}

Error unlisted(const std::string& pattern) {
  return {pattern, "the folders of the pattern cannot be listed"};
}

/// Returns the paths that match a pattern without "**".
std::vector<std::string> matches_of(const std::string& pattern) {
  std::vector<std::string> names;
  ::glob_t found{};
  const int result = ::glob(pattern.c_str(), GLOB_ERR, nullptr, &found);
  for (std::size_t i = 0; i < found.gl_pathc; ++i) names.emplace_back(found.gl_pathv[i]);
  ::globfree(&found);
  if (result != 0 && result != GLOB_NOMATCH) throw unlisted(pattern);
  return names;
}

/// Returns the position of a path component "**"; npos if there is none.
std::size_t find_stars(const std::string& pattern) {
  for (std::size_t at = pattern.find("**"); at != pattern.npos; at = pattern.find("**", at + 1)) {
    const std::size_t end = at + 2;
    if ((at == 0 || pattern[at - 1] == '/') && (end == pattern.size() || pattern[end] == '/')) {
      return at;
    }
  }
  return pattern.npos;
}

/// Escapes a name: returns a pattern that only this name matches.
std::string literal(const std::string& name) {
  std::string pattern;
  for (const char c : name) {
    if (std::string_view("*?[]\\").find(c) != std::string_view::npos) pattern += '\\';
    pattern += c;
  }
  return pattern;
}

/// Returns the paths that match in a folder and in the folders below it, except in hidden ones.
/// folder: ends with '/', or is empty for the current folder.
std::vector<std::string> matches_below(const std::string& folder, const std::string& pattern) {
  std::vector<std::string> names = matches_of(literal(folder) + pattern);
  std::error_code error;
  fs::recursive_directory_iterator at(folder.empty() ? "." : folder, error);
  for (; !error && at != fs::recursive_directory_iterator(); at.increment(error)) {
    std::error_code ignored;
    if (!at->is_directory(ignored)) continue;
    if (at->path().filename().string().front() == '.') {
      at.disable_recursion_pending();
      continue;
    }
    const std::string below = folder.empty() ? at->path().string().substr(2) : at->path().string();
    const std::vector<std::string> more = matches_of(literal(below) + '/' + pattern);
    names.insert(names.end(), more.begin(), more.end());
  }
  if (error) throw unlisted(folder + pattern);
  return names;
}

/// Expands a quoted pattern as the shell would. "**" stands for any number of folders, including
/// zero, but not for hidden ones.
void add_pattern(const std::string& pattern, std::vector<std::string>& files) {
  std::vector<std::string> names;
  const std::size_t stars = find_stars(pattern);
  if (stars == pattern.npos) {
    names = matches_of(pattern);
  } else {
    const std::string rest = pattern.substr(std::min(stars + 3, pattern.size()));
    if (find_stars(rest) != rest.npos) {
      throw Error(pattern, "has ** twice").remedy("use it once: it reaches all folders below");
    }
    std::vector<std::string> folders{""};
    if (stars > 0) folders = matches_of(pattern.substr(0, stars));
    for (const std::string& folder : folders) {
      const std::vector<std::string> more = matches_below(folder, rest.empty() ? "*" : rest);
      names.insert(names.end(), more.begin(), more.end());
    }
    std::erase_if(names, [](const std::string& name) {
      std::error_code ignored;
      return fs::is_directory(name, ignored);
    });
    std::sort(names.begin(), names.end());
  }
  if (names.empty()) throw Error(pattern, "no file matches").remedy("check the pattern");
  files.insert(files.end(), names.begin(), names.end());
}

/// Collects the files for a list of names.
class Names {
 public:
  Names(const std::string& format, std::vector<std::string>& files)
      : format_(format), files_(files) {}

  void add(const std::string& name) {
    std::error_code ignored;
    if (name == kStandardStream) {
      files_.push_back(name);
    } else if (exists(name)) {
      if (fs::is_directory(name, ignored) && fs::exists(fs::path(name) / kEptName, ignored)) {
        files_.push_back((fs::path(name) / kEptName).string());
      } else if (fs::is_directory(name, ignored)) {
        add_folder(name, format_, files_);
      } else {
        files_.push_back(name);
      }
    } else if (is_url(name)) {
      throw Error(shown_url(name), "files of points or cells are not read over the network")
          .remedy("download it first");
    } else if (name.size() > 1 && name.front() == '@') {
      add_list(name.substr(1));
    } else if (name.find_first_of("*?[") != name.npos) {
      add_pattern(name, files_);
    } else {
      files_.push_back(name);  // opening it gives the best error
    }
  }

 private:
  /// Adds the files of a list: one name per line, relative to the list's folder.
  void add_list(const std::string& list) {
    Input input(list);
    LineReader lines(input);
    const std::size_t before = files_.size();
    for (std::string_view line; lines.next(line);) {
      const std::string_view name = trim(line);
      if (name.empty() || name.front() == '#') continue;
      const std::string file = (fs::path(list).parent_path() / name).string();
      if (name.front() == '@') {
        throw Error(list, "a list cannot contain lists")
            .at_line(lines.number())
            .remedy("name them on the command line");
      }
      if (file.find_first_of("*?[") == file.npos && !exists(file)) {
        throw Error(list, "there is no file " + in_quotes(file))
            .at_line(lines.number())
            .remedy("correct the list");
      }
      add(file);
    }
    if (files_.size() == before)
      throw Error(list, "names no file").remedy("write one name on each line");
  }

  const std::string& format_;
  std::vector<std::string>& files_;
};

}  // namespace

std::vector<std::string> input_files(std::span<const std::string> names,
                                     const std::string& format) {
  std::vector<std::string> files;
  Names adder(format, files);
  for (const std::string& name : names) adder.add(name);
  return files;
}

std::string prj_beside(const std::string& file) {
  for (const char* const ending : {".prj", ".PRJ"}) {
    const fs::path path = fs::path(file).replace_extension(ending);
    std::error_code ignored;
    if (file != "-" && path != file && fs::is_regular_file(path, ignored)) return path.string();
  }
  return {};
}

}  // namespace terrace::stream
