// SPDX-License-Identifier: Apache-2.0
#include "base/available_memory.hpp"

#include <algorithm>
#include <fstream>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include <sys/resource.h>
#include <unistd.h>

#include "base/units.hpp"

namespace terrace::terrain {
namespace {

namespace fs = std::filesystem;

/// A cgroup hierarchy that limits memory.
struct Hierarchy {
  bool version_2 = false;
  std::string root;  ///< the cgroup mounted at `mount`, relative to the hierarchy's root
  fs::path mount;
};

bool has_word(std::string_view list, std::string_view word) {
  std::istringstream words{std::string(list)};
  for (std::string found; std::getline(words, found, ',');) {
    if (found == word) return true;
  }
  return false;
}

/// mountinfo escapes blanks in names as \040, and other characters likewise.
std::string unescaped(std::string_view text) {
  const auto octal = [](char c) { return c >= '0' && c <= '7'; };
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '\\' && i + 3 < text.size() && octal(text[i + 1]) && octal(text[i + 2]) &&
        octal(text[i + 3])) {
      out += static_cast<char>((text[i + 1] - '0') * 64 + (text[i + 2] - '0') * 8 +
                               (text[i + 3] - '0'));
      i += 3;
    } else {
      out += text[i];
    }
  }
  return out;
}

std::vector<Hierarchy> hierarchies(const fs::path& proc) {
  std::vector<Hierarchy> found;
  std::ifstream mounts(proc / "mountinfo");
  for (std::string line; std::getline(mounts, line);) {
    // 36 35 98:0 /root /mount options optional-fields - type source options
    const std::size_t dash = line.find(" - ");
    if (dash == std::string::npos) continue;
    std::istringstream before(line.substr(0, dash)), after(line.substr(dash + 3));
    std::string id, parent, device, root, mount, type, source, options;
    if (!(before >> id >> parent >> device >> root >> mount)) continue;
    if (!(after >> type >> source >> options)) continue;
    const bool version_2 = type == "cgroup2";
    if (!version_2 && !(type == "cgroup" && has_word(options, "memory"))) continue;
    found.push_back({version_2, unescaped(root), unescaped(mount)});
  }
  return found;
}

/// Returns the path of the process's cgroup in a hierarchy ("/" and names); nullopt if it has none.
std::optional<std::string> place_in(const Hierarchy& hierarchy, const fs::path& proc) {
  std::ifstream list(proc / "cgroup");
  for (std::string line; std::getline(list, line);) {
    // 4:memory:/a/b in version 1, 0::/a/b in version 2
    const std::size_t first = line.find(':');
    const std::size_t second = first == std::string::npos ? first : line.find(':', first + 1);
    if (second == std::string::npos) continue;
    const std::string_view controllers =
        std::string_view(line).substr(first + 1, second - first - 1);
    const bool mine =
        hierarchy.version_2 ? line.starts_with("0::") : has_word(controllers, "memory");
    if (mine) return line.substr(second + 1);
  }
  return std::nullopt;
}

/// Returns the number in a file; nullopt for "max" or without a number.
std::optional<std::uint64_t> number_in(const fs::path& file) {
  std::ifstream in(file);
  std::string word;
  in >> word;
  return number_from<std::uint64_t>(word);
}

void lower(std::optional<std::uint64_t>& least, std::optional<std::uint64_t> limit) {
  if (limit && (!least || *limit < *least)) least = limit;
}

}  // namespace

std::optional<std::uint64_t> cgroup_memory_limit(const fs::path& proc) {
  std::optional<std::uint64_t> least;
  for (const Hierarchy& hierarchy : hierarchies(proc)) {
    const std::optional<std::string> place = place_in(hierarchy, proc);
    if (!place) continue;
    // In a container the mount may show only a part of the hierarchy, and the process's path may be
    // relative to the hierarchy's root or to the mount's.
    fs::path below = fs::path(*place).lexically_relative("/");
    const fs::path within = fs::path(*place).lexically_relative(hierarchy.root);
    if (!within.empty() && *within.begin() != "..") below = within;
    fs::path group = (hierarchy.mount / below).lexically_normal();
    const fs::path top = hierarchy.mount.lexically_normal();
    for (;;) {
      for (const char* const name : {"memory.max", "memory.high", "memory.limit_in_bytes"}) {
        lower(least, number_in(group / name));
      }
      const fs::path parent = group.parent_path();
      if (group == top || parent == group) break;
      group = parent;
    }
  }
  return least;
}

std::uint64_t working_memory(const Context& context) {
  const std::uint64_t memory = context.memory_or(0);
  return memory - std::min(memory, kProcessBytes);
}

std::uint64_t available_memory_bytes() {
  std::uint64_t bytes = static_cast<std::uint64_t>(sysconf(_SC_PHYS_PAGES)) *
                        static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
  if (const auto limit = cgroup_memory_limit("/proc/self")) bytes = std::min(bytes, *limit);
  for (const auto resource : {RLIMIT_AS, RLIMIT_DATA}) {
    rlimit limit{};
    if (getrlimit(resource, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY) {
      bytes = std::min<std::uint64_t>(bytes, limit.rlim_cur);
    }
  }
  return bytes;
}

}  // namespace terrace::terrain
