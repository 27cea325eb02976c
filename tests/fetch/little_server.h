// A web server of a few lines, on loopback, for tests: answers what a function says.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include <arpa/inet.h>
#include <doctest/doctest.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

namespace tellurion::test {

struct Ask {
  std::string path;     ///< with the query
  std::string headers;  ///< as they came
};

/// How the server answers.
struct Say {
  int status = 200;
  std::string body{};
  std::vector<std::string> headers{};
  int claims = -1;                       ///< Content-Length, if not the body's
  bool hangs_up = false;                 ///< closes without a word
  std::chrono::milliseconds after{0};
  std::chrono::milliseconds lingers{0};  ///< before it closes
};

/// Answers as a server that gives parts of `file`, if a part is asked for.
inline Say part_of(const std::string& file, const Ask& ask, const std::string& etag = {}) {
  Say say{.body = file};
  if (!etag.empty()) say.headers.push_back("ETag: " + etag);
  const std::size_t at = ask.headers.find("\r\nRange: bytes=");
  if (at == std::string::npos) return say;
  const std::string range = ask.headers.substr(at + 15, ask.headers.find("\r\n", at + 2) - at - 15);
  const std::size_t first = std::stoull(range), last = std::min<std::size_t>(std::stoull(range.substr(range.find('-') + 1)), file.size() - 1);
  if (first >= file.size()) return Say{.status = 416, .headers = {fmt::format("Content-Range: bytes */{}", file.size())}};
  say.status = 206;
  say.body = file.substr(first, last - first + 1);
  say.headers.push_back(fmt::format("Content-Range: bytes {}-{}/{}", first, last, file.size()));
  return say;
}

class LittleServer {
 public:
  explicit LittleServer(std::function<Say(const Ask&)> answer) : answer_(std::move(answer)) {
    socket_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    REQUIRE(bind(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0);
    REQUIRE(listen(socket_, 128) == 0);
    socklen_t length = sizeof address;
    getsockname(socket_, reinterpret_cast<sockaddr*>(&address), &length);
    port_ = ntohs(address.sin_port);
    acceptor_ = std::jthread([this] { accept_all(); });
  }
  ~LittleServer() {
    closing_ = true;
    shutdown(socket_, SHUT_RDWR);
    close(socket_);
    acceptor_.join();
  }
  LittleServer(const LittleServer&) = delete;
  LittleServer& operator=(const LittleServer&) = delete;

  std::string url(const std::string& path) const { return fmt::format("http://127.0.0.1:{}{}", port_, path); }
  int asked(const std::string& path) const {
    std::lock_guard lock(mutex_);
    const auto found = counts_.find(path);
    return found == counts_.end() ? 0 : found->second;
  }
  int most_at_once() const { return most_at_once_; }

 private:
  void accept_all() {
    std::vector<std::jthread> talks;
    while (!closing_) {
      const int talk = accept(socket_, nullptr, nullptr);
      if (talk < 0) break;
      talks.emplace_back([this, talk] { answer_one(talk); });
    }
  }

  void answer_one(int talk) {
    const int now = ++at_once_;
    for (int most = most_at_once_; now > most && !most_at_once_.compare_exchange_weak(most, now);) {}
    std::string text;
    char buffer[4096];
    while (text.find("\r\n\r\n") == std::string::npos) {
      const auto count = recv(talk, buffer, sizeof buffer, 0);
      if (count <= 0) break;
      text.append(buffer, static_cast<std::size_t>(count));
    }
    Ask ask;
    if (const std::size_t begin = text.find(' '); begin != std::string::npos) ask.path = text.substr(begin + 1, text.find(' ', begin + 1) - begin - 1);
    ask.headers = text.substr(std::min(text.find("\r\n"), text.size()));
    {
      std::lock_guard lock(mutex_);
      ++counts_[ask.path];
    }
    const Say say = answer_(ask);
    rest(say.after);
    --at_once_;  // before the reply: who has it may ask for the next before this thread goes on
    if (!say.hangs_up) {
      std::string reply = fmt::format("HTTP/1.1 {} Some\r\nConnection: close\r\nContent-Length: {}\r\n", say.status,
                                      say.claims >= 0 ? static_cast<std::size_t>(say.claims) : say.body.size());
      for (const std::string& header : say.headers) reply += header + "\r\n";
      reply += "\r\n" + say.body;
      for (std::size_t sent = 0; sent < reply.size();) {
        const auto count = send(talk, reply.data() + sent, reply.size() - sent, MSG_NOSIGNAL);
        if (count <= 0) break;
        sent += static_cast<std::size_t>(count);
      }
    }
    rest(say.lingers);
    close(talk);
  }

  void rest(std::chrono::milliseconds left) const {
    for (; left.count() > 0 && !closing_; left -= std::chrono::milliseconds(10)) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }

  std::function<Say(const Ask&)> answer_;
  int socket_ = -1;
  int port_ = 0;
  std::atomic<bool> closing_{false};
  std::atomic<int> at_once_{0}, most_at_once_{0};
  mutable std::mutex mutex_;
  std::map<std::string, int> counts_;
  std::jthread acceptor_;
};

}  // namespace tellurion::test
