// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <map>
#include <string>

namespace terrace::stream {

/// Makes names distinct: of equal ones the second gets "_2". Time for a name does not grow with the
/// number of equal ones.
class DistinctNames {
 public:
  /// The name, or one made of it that has not been added yet.
  std::string add(const std::string& name) {
    std::string distinct = name;
    std::size_t number = 2;
    if (const auto known = next_.find(name); known != next_.end()) {
      number = known->second;
      do {
        distinct.assign(name).append("_").append(std::to_string(number++));
      } while (next_.count(distinct) > 0);
    }
    next_[name] = number;
    next_.emplace(distinct, 2);
    return distinct;
  }

 private:
  std::map<std::string, std::size_t> next_;  ///< of each name, the number for its next equal
};

}  // namespace terrace::stream
