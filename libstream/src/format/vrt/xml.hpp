// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace terrace::stream {

/// An element of an XML document, with all below it.
struct XmlElement {
  std::string name;
  std::map<std::string, std::string> attributes{};
  std::string text{};  ///< between its tags, that of children left out
  std::vector<XmlElement> children{};

  /// The first child of that name; nullptr if there is none.
  [[nodiscard]] const XmlElement* child(std::string_view name) const;
  /// Empty if there is none.
  [[nodiscard]] std::string attribute(const std::string& name) const;
};

/// The document's root. Documents that declare entities or other types are refused, so nothing
/// grows beyond the file and nothing else is read. Throws: Error naming line and cause for what is
/// not XML, is larger than 256 MiB or nested deeper than 32.
XmlElement read_xml(const std::string& file);

}  // namespace terrace::stream
