// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include <terrace/stream/message.hpp>

#include "core.hpp"

/// The names that Python has for enumerators and parameters of the libraries.

namespace terrace::python {

enum class ViewKind : std::uint8_t { mesh, points, surface };
enum class ViewReader : std::uint8_t { thread, frame };
enum class ModelKind : std::uint8_t { mesh, volume };

/// Returns the enumerator with a name. Defined for the enumerations in names.cpp.
/// Throws: ValueError that names the parameter and lists the known names.
template <class Enum>
Enum named(const std::string& name);

/// Sets `value` to the enumerator with the name that an option has, if it is given.
/// Throws: TypeError for an option that is not a text; ValueError.
template <class Enum>
void take_named(const py::dict& options, const char* option, Enum& value);

/// Returns a message of the libraries with the module's names of parameters.
py::str message_of(const stream::Message& message);

}  // namespace terrace::python
