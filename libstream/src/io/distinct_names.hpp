// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <map>
#include <string>

namespace terrace::stream {

/// Makes names distinct: a second "name" becomes "name_2". The time for a name does not grow with
/// the number of equal names.
class DistinctNames {
 public:
  /// Returns the name, or the name with a number if it has been added before.
  std::string add(const std::string& name) {
    std::string distinct = name;
    std::size_t number = 2;
    if (const auto entry = next_.find(name); entry != next_.end()) {
      number = entry->second;
      do {
        distinct.assign(name).append("_").append(std::to_string(number++));
      } while (next_.count(distinct) > 0);
    }
    next_[name] = number;
    next_.emplace(distinct, 2);
    return distinct;
  }

 private:
  std::map<std::string, std::size_t> next_;  ///< number for the next name equal to this one
};

}  // namespace terrace::stream
