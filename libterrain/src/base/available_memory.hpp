// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "terrace/terrain/context.hpp"

namespace terrace::terrain {

/// Bytes that this process may use: the machine's memory, or less where its cgroup (or one above
/// it, of version 1 or 2) or its limits RLIMIT_AS and RLIMIT_DATA say so. The only place that asks
/// the system; the libraries are passed a limit.
std::uint64_t available_memory_bytes();

/// Memory of the process itself: the program and its libraries, PROJ's database, and an open store.
inline constexpr std::uint64_t kProcessBytes = std::uint64_t{32} << 20;

/// Memory for all caches, tables and buffers of a job: context.memory_or(0) less kProcessBytes.
std::uint64_t working_memory(const Context& context);

/// The smallest memory limit of the cgroups that a process belongs to and of those above them;
/// nullopt if there is none or they cannot be read. `proc`: the process's folder in /proc, of which
/// the files cgroup and mountinfo are read.
std::optional<std::uint64_t> cgroup_memory_limit(const std::filesystem::path& proc);

}  // namespace terrace::terrain
