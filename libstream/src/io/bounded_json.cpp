// SPDX-License-Identifier: Apache-2.0
#include "io/bounded_json.hpp"

namespace terrace::stream {
namespace {

/// Counts the values and the depth of a text without keeping them.
class LimitChecker final : public nlohmann::json_sax<nlohmann::json> {
 public:
  LimitChecker(const JsonLimits& limits, const std::function<void(const char* cause)>& refuse)
      : limits_(limits), refuse_(refuse) {}

  bool null() override { return count(); }
  bool boolean(bool) override { return count(); }
  bool number_integer(number_integer_t) override { return count(); }
  bool number_unsigned(number_unsigned_t) override { return count(); }
  bool number_float(number_float_t, const string_t&) override { return count(); }
  bool string(string_t&) override { return count(); }
  bool binary(binary_t&) override { return count(); }
  bool key(string_t&) override { return count(); }
  bool start_object(std::size_t) override { return open(); }
  bool start_array(std::size_t) override { return open(); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }
  /// parse() reports the error afterwards.
  bool parse_error(std::size_t, const std::string&, const nlohmann::detail::exception&) override {
    return false;
  }

 private:
  bool count() {
    if (++values_ > limits_.values) refuse_("its JSON has too many values");
    return true;
  }
  bool open() {
    if (++depth_ > limits_.depth) refuse_("its JSON is nested too deeply");
    return count();
  }
  bool close() {
    --depth_;
    return count();
  }

  const JsonLimits& limits_;
  const std::function<void(const char* cause)>& refuse_;
  int depth_ = 0;
  std::size_t values_ = 0;
};

}  // namespace

nlohmann::json parse_bounded_json(std::string_view text, const JsonLimits& limits,
                                  const std::function<void(const char* cause)>& refuse) {
  LimitChecker checker(limits, refuse);
  nlohmann::json::sax_parse(text, &checker);
  return nlohmann::json::parse(text);
}

}  // namespace terrace::stream
