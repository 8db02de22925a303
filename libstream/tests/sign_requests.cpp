// SPDX-License-Identifier: Apache-2.0
// Signs the requests to S3 on standard input, one JSON object a line. Prints for each the target of
// the request and its header "authorization", one a line.
#include <iostream>
#include <string>

#include <nlohmann/json.hpp>

#include "net/aws_signature.hpp"

int main() {
  namespace net = terrace::stream::net;
  for (std::string line; std::getline(std::cin, line);) {
    const auto json = nlohmann::json::parse(line);
    net::AwsRequest request{.method = json.at("method"),
                            .host = json.at("host"),
                            .path = json.at("path"),
                            .headers = json.at("headers"),
                            .body = json.at("body")};
    for (const auto& pair : json.at("query")) request.query.emplace_back(pair.at(0), pair.at(1));
    const net::AwsCredentials credentials{json.at("key_id"), json.at("secret"), json.at("token")};
    const auto headers =
        net::signed_headers(request, credentials, json.at("region"), json.at("time"));
    std::cout << net::encoded_target(request) << '\n' << headers.at("authorization") << '\n';
  }
}
