// SPDX-License-Identifier: Apache-2.0
#include "net/aws_account.hpp"

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <iterator>
#include <string_view>
#include <utility>

#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include "terrace/stream/error.hpp"

namespace terrace::stream::net {
namespace {

using std::chrono::system_clock;

constexpr std::chrono::seconds kServerDeadline(10), kMachineDeadline(1);
/// Credentials are renewed this long before they expire.
constexpr std::chrono::minutes kRenewal(5);
constexpr std::size_t kMaxAnswer = std::size_t{1} << 20;

std::string variable(const char* name) {
  const char* const value = std::getenv(name);
  return value == nullptr ? std::string() : std::string(value);
}

bool is_yes(std::string text) {
  for (char& c : text) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return text == "YES" || text == "TRUE" || text == "1" || text == "ON";
}

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t\r\n");
  if (begin == text.npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t\r\n") + 1 - begin);
}

std::string home_file(const char* name, const char* named_by) {
  const std::string file = variable(named_by);
  return file.empty() ? variable("HOME") + "/.aws/" + name : file;
}

/// Adds the settings of a section of an INI file, if the file has it; others keep their values.
bool read_section(const std::string& file, const std::string& section,
                  std::map<std::string, std::string>& into) {
  std::ifstream in(file);
  bool inside = false, found = false;
  for (std::string line; std::getline(in, line);) {
    const std::string_view text = trimmed(line);
    if (text.starts_with('[')) {
      inside = trimmed(text.substr(1, text.find(']') - 1)) == section;
      found |= inside;
    } else if (const std::size_t equals = text.find('=');
               inside && equals != text.npos && !text.starts_with('#')) {
      into[std::string(trimmed(text.substr(0, equals)))] = trimmed(text.substr(equals + 1));
    }
  }
  return found;
}

std::string contents_of(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw Error(file, "cannot open the token of AWS credentials");
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  return std::string(trimmed(text));
}

std::string text_of(const HttpAnswer& answer) {
  return {reinterpret_cast<const char*>(answer.body.data()), answer.body.size()};
}

/// Parses "2026-11-28T12:00:00Z"; parts of seconds are ignored.
std::optional<system_clock::time_point> parse_time(const std::string& text) {
  std::tm parts{};
  if (strptime(text.c_str(), "%Y-%m-%dT%H:%M:%S", &parts) == nullptr) return std::nullopt;
  return system_clock::from_time_t(timegm(&parts));
}

/// Returns the text of the first element of this name in simple XML.
std::string element(const std::string& xml, const std::string& name) {
  const std::string open = "<" + name + ">";
  const std::size_t begin = xml.find(open);
  if (begin == xml.npos) return {};
  const std::size_t end = xml.find("</" + name + ">", begin);
  return end == xml.npos ? std::string()
                         : xml.substr(begin + open.size(), end - begin - open.size());
}

/// Throws the Error of a server that should have credentials.
[[noreturn]] void refuse(const std::string& server, const HttpAnswer& answer) {
  throw Error(server, "cannot get AWS credentials: " +
                          (answer.failure.empty() ? fmt::format("status {}", answer.status)
                                                  : answer.failure))
      .remedy("check the AWS_ variables of the environment");
}

}  // namespace

AwsAccount::AwsAccount(HttpClient& client, const NetworkOptions& options)
    : client_(client),
      buckets_(options.buckets),
      anonymous_(options.anonymous || is_yes(variable("AWS_NO_SIGN_REQUEST"))),
      requester_pays_(options.requester_pays || variable("AWS_REQUEST_PAYER") == "requester") {
  profile_name_ = variable("AWS_PROFILE");
  const bool is_default = profile_name_.empty() || profile_name_ == "default";
  const std::string name = is_default ? "default" : profile_name_;
  bool exists = read_section(home_file("config", "AWS_CONFIG_FILE"),
                             is_default ? name : "profile " + name, profile_);
  exists |= read_section(home_file("credentials", "AWS_SHARED_CREDENTIALS_FILE"), name, profile_);
  if (!exists && !profile_name_.empty()) {
    throw Error("~/.aws", "there is no profile '" + name + "'").remedy("check AWS_PROFILE");
  }
  region_ = options.region.empty() ? setting("AWS_REGION", nullptr) : options.region;
  if (region_.empty()) region_ = setting("AWS_DEFAULT_REGION", "region");
  if (region_.empty()) region_ = "us-east-1";
  endpoint_ = options.endpoint.empty() ? setting("AWS_ENDPOINT_URL_S3", nullptr) : options.endpoint;
  if (endpoint_.empty()) endpoint_ = setting("AWS_ENDPOINT_URL", "endpoint_url");
  const std::string in_host = variable("AWS_VIRTUAL_HOSTING");
  if (buckets_ == NetworkOptions::Buckets::as_required && !in_host.empty()) {
    buckets_ =
        is_yes(in_host) ? NetworkOptions::Buckets::in_host : NetworkOptions::Buckets::in_path;
  }
}

std::string AwsAccount::setting(const char* name, const char* key) const {
  const std::string value = variable(name);
  if (!value.empty() || key == nullptr) return value;
  const auto found = profile_.find(key);
  return found == profile_.end() ? std::string() : found->second;
}

bool AwsAccount::bucket_in_path(const std::string& bucket) const {
  if (buckets_ != NetworkOptions::Buckets::as_required) {
    return buckets_ == NetworkOptions::Buckets::in_path;
  }
  // The certificate of *.s3.amazonaws.com does not cover a bucket with dots.
  return !endpoint_.empty() || bucket.find('.') != bucket.npos;
}

std::optional<AwsCredentials> AwsAccount::credentials() {
  if (anonymous_) return std::nullopt;
  const std::lock_guard lock(mutex_);
  const bool expires =
      found_ && found_->expires && *found_->expires < system_clock::now() + kRenewal;
  if (!searched_ || expires) {
    found_ = find();
    searched_ = true;
  }
  return found_ ? std::optional(found_->credentials) : std::nullopt;
}

std::optional<AwsAccount::Temporary> AwsAccount::find() {
  const auto of_profile = [&](const char* key) {
    const auto found = profile_.find(key);
    return found == profile_.end() ? std::string() : found->second;
  };
  // A profile that is named overrides keys in the environment.
  if (profile_name_.empty()) {
    const AwsCredentials keys{variable("AWS_ACCESS_KEY_ID"), variable("AWS_SECRET_ACCESS_KEY"),
                              variable("AWS_SESSION_TOKEN")};
    if (!keys.key_id.empty() && !keys.secret.empty()) return Temporary{keys, {}};
  }
  const AwsCredentials keys{of_profile("aws_access_key_id"), of_profile("aws_secret_access_key"),
                            of_profile("aws_session_token")};
  if (!keys.key_id.empty() && !keys.secret.empty()) return Temporary{keys, {}};
  const std::string token_file = setting("AWS_WEB_IDENTITY_TOKEN_FILE", "web_identity_token_file");
  const std::string role = setting("AWS_ROLE_ARN", "role_arn");
  if (!token_file.empty() && !role.empty()) return from_web_identity(token_file, role);
  for (const char* const unknown : {"source_profile", "credential_process", "sso_session",
                                    "sso_start_url", "credential_source"}) {
    if (profile_.contains(unknown)) {
      throw Error("~/.aws", fmt::format("the profile uses {}, which is not supported", unknown))
          .remedy(
              "set AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY, as from "
              "`aws configure export-credentials`");
    }
  }
  if (auto found = from_container()) return found;
  return from_machine();
}

HttpAnswer AwsAccount::ask(HttpRequest request, std::chrono::milliseconds deadline) {
  request.follow = false;  // tokens in headers must not reach another host
  HttpTask task{.make = [&] { return request; }, .max_bytes = kMaxAnswer};
  client_.send({&task, 1}, deadline);
  return std::move(task.answer);
}

namespace {

/// Parses the JSON of a container's or machine's server; nullopt if it has no credentials.
template <class Temporary>
std::optional<Temporary> parse_credentials(const HttpAnswer& answer) {
  const auto json = nlohmann::json::parse(text_of(answer), nullptr, false);
  const auto text = [&](const char* name) {
    return json.is_object() && json.contains(name) && json[name].is_string()
               ? json[name].template get<std::string>()
               : std::string();
  };
  Temporary found{{text("AccessKeyId"), text("SecretAccessKey"), text("Token")},
                  parse_time(text("Expiration"))};
  if (found.credentials.key_id.empty() || found.credentials.secret.empty()) return std::nullopt;
  return found;
}

}  // namespace

AwsAccount::Temporary AwsAccount::from_web_identity(const std::string& token_file,
                                                    const std::string& role) {
  std::string session = setting("AWS_ROLE_SESSION_NAME", "role_session_name");
  if (session.empty()) session = "terrace";
  std::string server = variable("AWS_ENDPOINT_URL_STS");
  if (server.empty()) server = fmt::format("https://sts.{}.amazonaws.com", region_);
  const HttpAnswer answer =
      ask({.url = server + "/",
           .method = "POST",
           .headers = {{"content-type", "application/x-www-form-urlencoded"}},
           .body = fmt::format("Action=AssumeRoleWithWebIdentity&Version=2011-06-15&RoleArn={}"
                               "&RoleSessionName={}&WebIdentityToken={}",
                               percent_encoded(role), percent_encoded(session),
                               percent_encoded(contents_of(token_file)))},
          kServerDeadline);
  const std::string xml = text_of(answer);
  Temporary found{
      {element(xml, "AccessKeyId"), element(xml, "SecretAccessKey"), element(xml, "SessionToken")},
      parse_time(element(xml, "Expiration"))};
  if (answer.status != 200 || found.credentials.secret.empty()) refuse(shown_url(server), answer);
  return found;
}

std::optional<AwsAccount::Temporary> AwsAccount::from_container() {
  const std::string relative = variable("AWS_CONTAINER_CREDENTIALS_RELATIVE_URI");
  const std::string url = relative.empty() ? variable("AWS_CONTAINER_CREDENTIALS_FULL_URI")
                                           : "http://169.254.170.2" + relative;
  if (url.empty()) return std::nullopt;
  HttpRequest request{.url = url};
  std::string token = variable("AWS_CONTAINER_AUTHORIZATION_TOKEN");
  const std::string token_file = variable("AWS_CONTAINER_AUTHORIZATION_TOKEN_FILE");
  if (!token_file.empty()) token = contents_of(token_file);
  if (!token.empty()) request.headers["authorization"] = token;
  const HttpAnswer answer = ask(request, kServerDeadline);
  auto found = parse_credentials<Temporary>(answer);
  if (answer.status != 200 || !found) refuse(shown_url(url), answer);
  return found;
}

std::optional<AwsAccount::Temporary> AwsAccount::from_machine() {
  if (is_yes(variable("AWS_EC2_METADATA_DISABLED"))) return std::nullopt;
  std::string server = variable("AWS_EC2_METADATA_SERVICE_ENDPOINT");
  if (server.empty()) server = "http://169.254.169.254";
  while (server.ends_with('/')) server.pop_back();
  const HttpAnswer token = ask({.url = server + "/latest/api/token",
                                .method = "PUT",
                                .headers = {{"x-aws-ec2-metadata-token-ttl-seconds", "300"}}},
                               kMachineDeadline);
  if (token.status != 200) return std::nullopt;  // not a machine of AWS
  const std::map<std::string, std::string> headers{{"x-aws-ec2-metadata-token", text_of(token)}};
  const std::string folder = server + "/latest/meta-data/iam/security-credentials/";
  const HttpAnswer roles = ask({.url = folder, .headers = headers}, kMachineDeadline);
  if (roles.status != 200) return std::nullopt;  // a machine without a role
  const std::string text = text_of(roles);
  const std::string role(trimmed(std::string_view(text).substr(0, text.find('\n'))));
  if (role.empty()) return std::nullopt;
  const HttpAnswer answer =
      ask({.url = folder + percent_encoded(role), .headers = headers}, kMachineDeadline);
  return parse_credentials<Temporary>(answer);
}

}  // namespace terrace::stream::net
