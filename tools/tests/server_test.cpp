// SPDX-License-Identifier: GPL-3.0-or-later
#include "serve/server.hpp"

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <thread>
#include <vector>

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

namespace terrace::tools {
namespace {

/// A client that has sent a request for a file.
class Client {
 public:
  Client(std::uint16_t port, const std::string& path) : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    // Small, so that the server soon has to wait until this client reads.
    constexpr int kReceiveBytes = 4096;
    ::setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &kReceiveBytes, sizeof kReceiveBytes);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const std::string request =
        "GET " + path + " HTTP/1.1\r\nHost: localhost:" + std::to_string(port) + "\r\n\r\n";
    if (::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) {
      // If the server has refused the connection already, its answer is still there.
      ::send(socket_, request.data(), request.size(), MSG_NOSIGNAL);
    }
  }
  ~Client() { ::close(socket_); }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  /// Waits for the beginning of the answer and returns its status, 0 if there is none.
  int status() {
    std::array<char, 12> line{};
    std::size_t size = 0;
    while (size < line.size()) {
      const ssize_t got = ::recv(socket_, line.data() + size, line.size() - size, 0);
      if (got <= 0) return 0;
      size += static_cast<std::size_t>(got);
    }
    return std::stoi(std::string(line.data() + 9, 3));
  }

 private:
  int socket_;
};

TEST(Server, RefusesConnectionsBeyondTheLimitForNow) {
  constexpr std::size_t kMoreThanSocketsHold = std::size_t{64} << 20;
  Site site;
  site["big"] = {stream::bytes_in_memory("big", std::vector<std::byte>(kMoreThanSocketsHold)),
                 "application/octet-stream", "\"1\"", true};
  site["small"] = {stream::bytes_in_memory("small", std::vector<std::byte>(7)), "text/plain",
                   "\"2\"", true};
  Server server([&]() -> const Site& { return site; }, 0, {.connections = 2});
  std::atomic<bool> stopped{false};
  const std::jthread serving([&] { server.run([&] { return stopped.load(); }); });
  const std::uint16_t port = server.access().port;
  {
    Client one(port, "/big"), other(port, "/big");
    EXPECT_EQ(one.status(), 200);
    EXPECT_EQ(other.status(), 200);
    // Both are receiving, so neither can be ended in favour of a third.
    EXPECT_EQ(Client(port, "/small").status(), 503);
    EXPECT_EQ(Client(port, "/small").status(), 503);
  }
  int status = 0;
  for (int i = 0; i < 100 && status != 200; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    status = Client(port, "/small").status();
  }
  EXPECT_EQ(status, 200);
  stopped = true;
}

}  // namespace
}  // namespace terrace::tools
