// SPDX-License-Identifier: GPL-3.0-or-later
#include "serve/server.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <list>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <boost/asio/buffer.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <fmt/core.h>
#include <netinet/in.h>
#include <unistd.h>

#include "serve/http_rules.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::tools {
namespace {

namespace fs = std::filesystem;
namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using asio::ip::tcp;
using boost::system::error_code;

constexpr std::size_t kChunkBytes = std::size_t{64} * 1024;

/// Returns 128 random bits from the operating system as hexadecimal digits.
std::string random_token() {
  std::array<unsigned char, 16> bytes{};
  if (::getentropy(bytes.data(), bytes.size()) != 0) {
    throw stream::system_error("getentropy", "cannot get random numbers", errno);
  }
  std::string text;
  for (const unsigned byte : bytes) {
    for (const unsigned digit : {byte >> 4U, byte & 15U}) text += "0123456789abcdef"[digit];
  }
  return text;
}

/// Returns an endpoint in the notation of /proc/net/tcp, such as "0100007F:1F90".
std::string endpoint_text(std::uint32_t address, std::uint16_t port) {
  char text[16];
  std::snprintf(text, sizeof text, "%08X:%04X", address, port);
  return text;
}

/// Returns the inode number of the client's socket if it belongs to this user, otherwise an empty
/// string. `client` is the endpoint in the notation of endpoint_text().
std::string socket_of_client(const std::string& client, std::uint16_t server_port) {
  std::ifstream table("/proc/net/tcp");
  std::string line, skipped, local, remote, user, socket;
  std::getline(table, line);
  while (std::getline(table, line)) {
    std::istringstream fields(line);
    fields >> skipped >> local >> remote;
    if (local != client || !remote.ends_with(endpoint_text(0, server_port).substr(8))) continue;
    for (int i = 0; i < 4; ++i) fields >> skipped;  // state, queues, timer, retransmissions
    fields >> user >> skipped >> socket;
    return user == fmt::format("{}", ::geteuid()) && socket != "0" ? socket : std::string();
  }
  return {};
}

/// Returns whether the client of a connection over 127.0.0.1 belongs to this process's user and
/// session, like a command typed in the same terminal. Returns false if the system does not reveal
/// it. `address` is the client's, as in sockaddr_in. Ports are in host byte order.
bool is_of_this_session(std::uint32_t address, std::uint16_t client_port,
                        std::uint16_t server_port) {
  const std::string socket = socket_of_client(endpoint_text(address, client_port), server_port);
  const pid_t session = ::getsid(0);
  if (socket.empty() || session <= 0) return false;
  const std::string link = fmt::format("socket:[{}]", socket);
  std::error_code error;
  for (fs::directory_iterator process("/proc", error), end; !error && process != end;
       process.increment(error)) {
    const std::string name = process->path().filename().string();
    pid_t number = 0;
    const auto [last, fault] = std::from_chars(name.data(), name.data() + name.size(), number);
    if (fault != std::errc() || last != name.data() + name.size()) continue;
    if (::getsid(number) != session) continue;
    std::error_code ended;
    for (fs::directory_iterator file(process->path() / "fd", ended), none; !ended && file != none;
         file.increment(ended)) {
      std::error_code closed;
      if (fs::read_symlink(file->path(), closed) == link) return true;
    }
  }
  return false;
}

class Session;

/// The connections of a server.
struct Connections {
  std::size_t open = 0;
  /// Connections without a complete request, ordered by how long they have waited for one.
  std::list<Session*> waiting;

  /// Ends the connection that has waited longest, so that idle ones never block others. Returns
  /// false if none is waiting.
  bool end_oldest();
};

/// One connection: it reads a request, sends the answer, and repeats.
class Session : public std::enable_shared_from_this<Session> {
 public:
  Session(tcp::socket socket, const std::function<const Site&()>& site, const Access& access,
          const ServerLimits& limits, Connections& connections)
      : stream_(std::move(socket)),
        site_(site),
        access_(access),
        limits_(limits),
        connections_(connections) {
    ++connections_.open;
  }
  ~Session() {
    stop_waiting();
    --connections_.open;
  }
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  void start(bool full) {
    error_code ignored;
    stream_.socket().set_option(tcp::no_delay(true), ignored);
    if (full) {
      answer({.status = 503, .close = true, .reason = "too many connections"}, false);
    } else {
      read();
    }
  }
  void close() {
    error_code ignored;
    stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
    stream_.close();
  }
  void stop_waiting() {
    if (waiting_position_)
      connections_.waiting.erase(*std::exchange(waiting_position_, std::nullopt));
  }

 private:
  void read() {
    waiting_position_ = connections_.waiting.insert(connections_.waiting.end(), this);
    parser_.emplace();
    parser_->header_limit(static_cast<std::uint32_t>(limits_.header_bytes));
    parser_->body_limit(0);
    stream_.expires_after(limits_.request);
    http::async_read(
        stream_, buffer_, *parser_,
        [self = shared_from_this()](error_code error, std::size_t) { self->received(error); });
  }
  void received(error_code error) {
    stop_waiting();
    if (error == http::error::header_limit) {
      return answer({.status = 431, .close = true, .reason = "the request header is too large"},
                    false);
    }
    if (error == http::error::body_limit) {
      return answer({.status = 413, .close = true, .reason = "request bodies are not supported"},
                    false);
    }
    if (error) {
      // There is no one to answer if the connection was closed or reset or the request took too
      // long. All other errors mean that the bytes are not HTTP.
      const bool is_http =
          error.category() == http::make_error_code(http::error::bad_method).category();
      if (!is_http || error == http::error::end_of_stream ||
          error == http::error::partial_message) {
        return close();
      }
      return answer({.status = 400, .close = true, .reason = "not an HTTP request"}, false);
    }
    const auto& request = parser_->get();
    const auto text = [](beast::string_view view) {
      return std::string_view(view.data(), view.size());
    };
    const auto field = [&](http::field name) { return text(request[name]); };
    Answer reply = answer_to({.method = text(request.method_string()),
                              .target = text(request.target()),
                              .range = field(http::field::range),
                              .if_range = field(http::field::if_range),
                              .if_none_match = field(http::field::if_none_match),
                              .host = field(http::field::host),
                              .hosts = request.count(http::field::host),
                              .trusted = is_trusted()},
                             site_(), access_);
    reply.close = reply.close || !request.keep_alive();
    answer(std::move(reply), request.method() == http::verb::head);
  }
  /// Returns whether a request without a token comes from a program of this session. Browsers do
  /// not count, because they act for the pages that they show.
  bool is_trusted() {
    const auto& request = parser_->get();
    const beast::string_view target = request.target();
    if (!query_value({target.data(), target.size()}, "token").empty() ||
        request.find("Sec-Fetch-Site") != request.end() ||
        request.find(http::field::origin) != request.end() ||
        request.find(http::field::referer) != request.end()) {
      return false;
    }
    if (!own_session_) {
      error_code gone;
      const tcp::endpoint client = stream_.socket().remote_endpoint(gone);
      own_session_ = !gone && client.address().is_v4() &&
                     is_of_this_session(htonl(client.address().to_v4().to_uint()), client.port(),
                                        access_.port);
    }
    return *own_session_;
  }
  void answer(Answer reply, bool head) {
    reply_ = std::move(reply);
    header_ = header_of(reply_);
    offset_ = reply_.first;
    remaining_ = head || reply_.bytes == nullptr ? 0 : reply_.length;
    write(true);
  }
  void write(bool with_header) {
    const std::size_t size =
        static_cast<std::size_t>(std::min<std::uint64_t>(remaining_, kChunkBytes));
    try {
      chunk_.resize(size);
      if (size > 0) reply_.bytes->read(offset_, chunk_);
    } catch (const stream::Error&) {
      return close();  // The file was truncated, so the client receives a short body.
    }
    offset_ += size;
    remaining_ -= size;
    const std::array<asio::const_buffer, 2> buffers{
        with_header ? asio::buffer(header_) : asio::const_buffer(), asio::buffer(chunk_)};
    stream_.expires_after(limits_.chunk);
    asio::async_write(stream_, buffers, [self = shared_from_this()](error_code error, std::size_t) {
      if (error) return self->close();
      if (self->remaining_ > 0) return self->write(false);
      if (self->reply_.close) return self->close();
      self->read();
    });
  }
  beast::tcp_stream stream_;
  const std::function<const Site&()>& site_;
  const Access& access_;
  const ServerLimits& limits_;
  Connections& connections_;
  std::optional<std::list<Session*>::iterator> waiting_position_;  ///< position in the waiting list
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::empty_body>> parser_;
  Answer reply_;
  std::string header_;
  std::vector<std::byte> chunk_;
  std::uint64_t offset_ = 0, remaining_ = 0;
  std::optional<bool> own_session_;  ///< whether the client is trusted, once known
};

bool Connections::end_oldest() {
  if (waiting.empty()) return false;
  Session& oldest = *waiting.front();
  oldest.stop_waiting();
  oldest.close();
  return true;
}

}  // namespace

struct Server::Impl {
  Impl(std::function<const Site&()> site_function, const ServerLimits& server_limits)
      : site(std::move(site_function)), limits(server_limits) {}

  void accept() {
    acceptor.async_accept([this](error_code error, tcp::socket socket) {
      if (error == asio::error::operation_aborted) return;
      if (!error) {
        const bool full = connections.open >= limits.connections && !connections.end_oldest();
        std::make_shared<Session>(std::move(socket), site, access, limits, connections)
            ->start(full);
        return accept();
      }
      // The process has no file descriptors left, so free one for another connection.
      connections.end_oldest();
      pause.expires_after(std::chrono::milliseconds(50));
      pause.async_wait([this](error_code failure) {
        if (!failure) accept();
      });
    });
  }
  void watch(const std::function<bool()>& stopped) {
    timer.expires_after(std::chrono::milliseconds(100));
    timer.async_wait([this, &stopped](error_code error) {
      if (error) return;
      if (stopped()) return context.stop();
      watch(stopped);
    });
  }

  std::function<const Site&()> site;
  Access access;
  ServerLimits limits;
  Connections connections;
  asio::io_context context{1};
  tcp::acceptor acceptor{context};
  asio::steady_timer timer{context}, pause{context};
};

Server::Server(std::function<const Site&()> site, std::uint16_t port, const ServerLimits& limits)
    : impl_(std::make_unique<Impl>(std::move(site), limits)) {
  try {
    const tcp::endpoint here(asio::ip::address_v4::loopback(), port);
    impl_->acceptor.open(here.protocol());
    impl_->acceptor.set_option(tcp::acceptor::reuse_address(true));
    impl_->acceptor.bind(here);
    impl_->acceptor.listen();
  } catch (const boost::system::system_error& error) {
    throw stream::Error(fmt::format("127.0.0.1:{}", port),
                        "cannot be served: " + error.code().message())
        .remedy("name another port");
  }
  impl_->access = {impl_->acceptor.local_endpoint().port(), random_token()};
}

Server::~Server() = default;

const Access& Server::access() const { return impl_->access; }

void Server::run(const std::function<bool()>& stopped) {
  impl_->accept();
  impl_->watch(stopped);
  impl_->context.run();
}

}  // namespace terrace::tools
