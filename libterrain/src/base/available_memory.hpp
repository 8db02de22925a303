// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "terrace/terrain/context.hpp"

namespace terrace::terrain {

/// Returns the bytes that this process may use: the machine's memory, or less if its cgroup (or a
/// parent of it, of version 1 or 2) or the limits RLIMIT_AS and RLIMIT_DATA allow less. Only this
/// function queries the system; the libraries receive a limit.
std::uint64_t available_memory_bytes();

/// Memory of the process itself: the program, its libraries, PROJ's database and an open store.
inline constexpr std::uint64_t kProcessBytes = std::uint64_t{32} << 20;

/// Memory for all caches, tables and buffers of a job: context.memory_or(0) minus kProcessBytes.
std::uint64_t working_memory(const Context& context);

/// Returns the smallest memory limit of the process's cgroups and their parents; nullopt if there
/// is no limit or it cannot be read. `proc`: the process's folder in /proc, with the files cgroup
/// and mountinfo.
std::optional<std::uint64_t> cgroup_memory_limit(const std::filesystem::path& proc);

}  // namespace terrace::terrain
