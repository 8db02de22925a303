// SPDX-License-Identifier: Apache-2.0
#include "net/http_client.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <deque>
#include <mutex>
#include <random>
#include <semaphore>
#include <string_view>
#include <thread>

#include <curl/curl.h>
#include <fmt/core.h>

#include "spares.hpp"

namespace terrace::stream::net {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr int kInParallel = 8;
constexpr milliseconds kFirstWait(100), kLongestWait(10'000), kLongestConnect(30'000);
/// A connection that carries nothing for this long is lost.
constexpr long kStalledSeconds = 30;
constexpr long kMaxRedirections = 5;

struct FreeList {
  void operator()(curl_slist* list) const { curl_slist_free_all(list); }
};
struct FreeEasy {
  void operator()(CURL* easy) const { curl_easy_cleanup(easy); }
};
struct FreeMulti {
  void operator()(CURLM* multi) const { curl_multi_cleanup(multi); }
};

/// Connections of one thread at a time.
struct Connections {
  std::unique_ptr<CURLM, FreeMulti> multi{curl_multi_init()};
};

/// An attempt to carry out a task.
struct Transfer {
  HttpTask* task = nullptr;
  HttpRequest request{};
  std::unique_ptr<CURL, FreeEasy> easy{curl_easy_init()};
  std::unique_ptr<curl_slist, FreeList> headers{};
};

/// A task that waits for its next attempt.
struct Waiting {
  HttpTask* task = nullptr;
  int attempts = 0;
  Clock::time_point from{};
};

std::string lower(std::string_view text) {
  std::string out(text);
  for (char& c : out) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return out;
}

std::size_t take_header(char* data, std::size_t, std::size_t size, void* to) {
  HttpAnswer& answer = *static_cast<HttpAnswer*>(to);
  std::string_view line(data, size);
  while (!line.empty() && (line.back() == '\r' || line.back() == '\n')) line.remove_suffix(1);
  if (line.starts_with("HTTP/")) {  // the first line of an answer, also after a redirection
    answer.headers.clear();
    answer.body.clear();
  } else if (const std::size_t colon = line.find(':'); colon != line.npos) {
    std::string_view value = line.substr(colon + 1);
    value.remove_prefix(std::min(value.find_first_not_of(" \t"), value.size()));
    while (!value.empty() && (value.back() == ' ' || value.back() == '\t')) value.remove_suffix(1);
    answer.headers[lower(line.substr(0, colon))] = value;
  }
  return size;
}

std::size_t take_body(char* data, std::size_t, std::size_t size, void* to) {
  HttpTask& task = *static_cast<HttpTask*>(to);
  std::vector<std::byte>& body = task.answer.body;
  if (size > task.max_bytes - body.size()) {
    task.answer.too_long = true;
    return 0;  // ends the transfer
  }
  const auto* const bytes = reinterpret_cast<const std::byte*>(data);
  body.insert(body.end(), bytes, bytes + size);
  return size;
}

bool is_transient(CURLcode code) {
  switch (code) {
    case CURLE_GOT_NOTHING:
    case CURLE_HTTP2:
    case CURLE_HTTP2_STREAM:
    case CURLE_OPERATION_TIMEDOUT:
    case CURLE_PARTIAL_FILE:
    case CURLE_RECV_ERROR:
    case CURLE_SEND_ERROR:
      return true;
    default:
      return false;
  }
}

bool is_transient(int status) {
  // 501 and 505 mean that the server lacks a function.
  return status == 408 || status == 429 ||
         (status >= 500 && status < 600 && status != 501 && status != 505);
}

/// Whether a body has fewer bytes than Content-Range states, as of a server that closes the
/// connection early without having sent a length.
bool is_cut_short(const HttpAnswer& answer) {
  const auto range = ContentRange::parse(answer.header("content-range"));
  return range && answer.body.size() < range->end - range->first;
}

/// Describes a failed connection in words of libcurl that cannot contain the URL.
std::string words_of(CURLcode code) { return curl_easy_strerror(code); }

/// Returns the wait before the next attempt: a random part of a time that doubles, or what the
/// server asks for.
milliseconds wait_before(int attempts, const HttpAnswer& answer) {
  thread_local std::minstd_rand random{std::random_device{}()};
  const milliseconds longest = std::min(kLongestWait, kFirstWait * (1 << std::min(attempts, 10)));
  milliseconds wait(
      std::uniform_int_distribution<long>(longest.count() / 2, longest.count())(random));
  const std::string& asked = answer.header("retry-after");
  long seconds = 0;
  const auto [end, error] = std::from_chars(asked.data(), asked.data() + asked.size(), seconds);
  if (error == std::errc() && end == asked.data() + asked.size() && seconds > 0) {
    wait = std::max(wait, std::min<milliseconds>(std::chrono::seconds(seconds), kLongestWait));
  }
  return wait;
}

milliseconds until(Clock::time_point time) {
  return std::max(milliseconds(0), std::chrono::ceil<milliseconds>(time - Clock::now()));
}

}  // namespace

const std::string& HttpAnswer::header(const std::string& name) const {
  static const std::string none;
  const auto found = headers.find(name);
  return found == headers.end() ? none : found->second;
}

std::optional<ContentRange> ContentRange::parse(std::string_view text) {
  constexpr std::string_view kUnit = "bytes ";
  if (!lower(text).starts_with(kUnit)) return std::nullopt;
  text.remove_prefix(kUnit.size());
  const auto number = [&](char after) -> std::optional<std::uint64_t> {
    std::uint64_t value = 0;
    const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc()) return std::nullopt;
    text.remove_prefix(static_cast<std::size_t>(stop - text.data()));
    if (after == '\0') return text.empty() ? std::optional(value) : std::nullopt;
    if (!text.starts_with(after)) return std::nullopt;
    text.remove_prefix(1);
    return value;
  };
  ContentRange range;
  if (text.starts_with("*/")) {
    text.remove_prefix(2);
  } else {
    const auto first = number('-'), last = number('/');
    if (!first || !last || *last < *first || *last == UINT64_MAX) return std::nullopt;
    range.first = *first;
    range.end = *last + 1;
  }
  const auto total = number('\0');
  if (!total || range.end > *total) return std::nullopt;
  range.total = *total;
  return range;
}

struct HttpClient::Impl {
  Spares<Connections> connections;
  std::counting_semaphore<kInParallel> places{kInParallel};

  void begin(Transfer& transfer, CURLM* multi, Clock::time_point end) const;
};

HttpClient::HttpClient() : impl_(std::make_unique<Impl>()) {
  static std::once_flag once;
  std::call_once(once, [] { curl_global_init(CURL_GLOBAL_DEFAULT); });
}
HttpClient::~HttpClient() = default;

void HttpClient::Impl::begin(Transfer& transfer, CURLM* multi, Clock::time_point end) const {
  HttpTask& task = *transfer.task;
  task.answer = {};
  transfer.request = task.make();
  const HttpRequest& request = transfer.request;
  CURL* const easy = transfer.easy.get();
  const auto add = [&](const std::string& line) {
    curl_slist* const list = curl_slist_append(transfer.headers.get(), line.c_str());
    if (list == nullptr) return;
    static_cast<void>(transfer.headers.release());
    transfer.headers.reset(list);
  };
  for (const auto& [name, value] : request.headers) add(name + ": " + value);
  if (!request.body.empty() || request.method == "PUT") {
    add("expect:");
    curl_easy_setopt(easy, CURLOPT_POSTFIELDS, request.body.c_str());
    curl_easy_setopt(easy, CURLOPT_POSTFIELDSIZE, static_cast<long>(request.body.size()));
  }
  if (request.method != "GET") {
    curl_easy_setopt(easy, CURLOPT_CUSTOMREQUEST, request.method.c_str());
  }
  curl_easy_setopt(easy, CURLOPT_URL, request.url.c_str());
  curl_easy_setopt(easy, CURLOPT_HTTPHEADER, transfer.headers.get());
  curl_easy_setopt(easy, CURLOPT_PROTOCOLS_STR, "http,https");
  // An encrypted connection stays encrypted.
  curl_easy_setopt(easy, CURLOPT_REDIR_PROTOCOLS_STR,
                   request.url.starts_with("https:") ? "https" : "http,https");
  curl_easy_setopt(easy, CURLOPT_PATH_AS_IS, 1L);
  curl_easy_setopt(easy, CURLOPT_FOLLOWLOCATION, request.follow ? 1L : 0L);
  curl_easy_setopt(easy, CURLOPT_MAXREDIRS, kMaxRedirections);
  curl_easy_setopt(easy, CURLOPT_NOSIGNAL, 1L);
  curl_easy_setopt(easy, CURLOPT_USERAGENT, "terrace");
  const milliseconds left = std::max(milliseconds(1), until(end));
  curl_easy_setopt(easy, CURLOPT_TIMEOUT_MS, static_cast<long>(left.count()));
  curl_easy_setopt(easy, CURLOPT_CONNECTTIMEOUT_MS,
                   static_cast<long>(std::min(left, kLongestConnect).count()));
  curl_easy_setopt(easy, CURLOPT_LOW_SPEED_LIMIT, 1L);
  curl_easy_setopt(easy, CURLOPT_LOW_SPEED_TIME, kStalledSeconds);
  curl_easy_setopt(easy, CURLOPT_HEADERFUNCTION, take_header);
  curl_easy_setopt(easy, CURLOPT_HEADERDATA, &task.answer);
  curl_easy_setopt(easy, CURLOPT_WRITEFUNCTION, take_body);
  curl_easy_setopt(easy, CURLOPT_WRITEDATA, &task);
  curl_multi_add_handle(multi, easy);
}

void HttpClient::send(std::span<HttpTask> tasks, milliseconds deadline) {
  const Clock::time_point end = Clock::now() + deadline;
  std::deque<Waiting> waiting;
  for (HttpTask& task : tasks) waiting.push_back({&task});
  std::vector<std::pair<std::unique_ptr<Transfer>, Waiting>> running;
  auto connections = impl_->connections.take();
  CURLM* const multi = connections->multi.get();
  const auto finish = [&](std::size_t number) {
    curl_multi_remove_handle(multi, running[number].first->easy.get());
    running.erase(running.begin() + static_cast<std::ptrdiff_t>(number));
    impl_->places.release();
  };
  try {
    while (!waiting.empty() || !running.empty()) {
      // Tasks whose wait is over, in order, as long as there are places.
      for (auto next = waiting.begin(); next != waiting.end();) {
        if (until(next->from).count() > 0) {
          ++next;
          continue;
        }
        // Waits for a place only if it holds none, so threads cannot wait for each other.
        if (running.empty()) {
          impl_->places.acquire();
        } else if (!impl_->places.try_acquire()) {
          break;
        }
        auto transfer = std::make_unique<Transfer>();
        transfer->task = next->task;
        running.emplace_back(std::move(transfer), *next);
        next = waiting.erase(next);
        impl_->begin(*running.back().first, multi, end);
      }
      milliseconds pause(1000);
      for (const Waiting& task : waiting) {
        if (running.size() < kInParallel) pause = std::min(pause, until(task.from));
      }
      if (running.empty()) {
        std::this_thread::sleep_for(pause);
        continue;
      }
      int still = 0;
      curl_multi_perform(multi, &still);
      if (still == static_cast<int>(running.size())) {
        // Another thread may free a place meanwhile.
        if (!waiting.empty()) pause = std::min(pause, milliseconds(20));
        curl_multi_poll(multi, nullptr, 0, static_cast<int>(pause.count()), nullptr);
      }
      int left = 0;
      while (const CURLMsg* const message = curl_multi_info_read(multi, &left)) {
        if (message->msg != CURLMSG_DONE) continue;
        const CURLcode code = message->data.result;
        const auto at = std::find_if(running.begin(), running.end(), [&](const auto& pair) {
          return pair.first->easy.get() == message->easy_handle;
        });
        Waiting task = at->second;
        HttpAnswer& answer = task.task->answer;
        long status = 0;
        curl_easy_getinfo(message->easy_handle, CURLINFO_RESPONSE_CODE, &status);
        answer.status = static_cast<int>(status);
        if (code != CURLE_OK && !answer.too_long) {
          answer.failure = words_of(code);
          answer.transient = is_transient(code);
        }
        answer.transient = answer.transient || (code == CURLE_OK && is_transient(answer.status));
        if (answer.status == 206 && code == CURLE_OK && is_cut_short(answer)) {
          answer.failure = "the body is shorter than its header says";
          answer.transient = true;
        }
        finish(static_cast<std::size_t>(at - running.begin()));
        if (!answer.transient) continue;
        task.from = Clock::now() + wait_before(task.attempts++, answer);
        if (task.from < end) waiting.push_back(task);
      }
    }
  } catch (...) {
    while (!running.empty()) finish(running.size() - 1);
    throw;
  }
  impl_->connections.put(std::move(connections));
}

}  // namespace terrace::stream::net
