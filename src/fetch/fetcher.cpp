#include "fetch/fetcher.h"

#include <algorithm>
#include <atomic>
#include <cctype>
#include <charconv>
#include <condition_variable>
#include <cstdlib>
#include <ctime>
#include <map>
#include <mutex>
#include <random>
#include <string_view>
#include <thread>
#include <unordered_map>
#include <utility>
#include <vector>

#include <curl/curl.h>
#include <fmt/format.h>

namespace tellurion::fetch {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kMostRedirects = 5;

struct EasyDeleter {
  void operator()(CURL* easy) const { curl_easy_cleanup(easy); }
};
using Easy = std::unique_ptr<CURL, EasyDeleter>;

struct HeaderDeleter {
  void operator()(curl_slist* list) const { curl_slist_free_all(list); }
};
using HeaderList = std::unique_ptr<curl_slist, HeaderDeleter>;

/// Scheme, name and port of a server. Fields are the network thread's own.
struct Host {
  int flying = 0;            ///< transfers in flight
  bool multiplexes = false;  ///< many over one connection
};

struct Transfer {
  Fetcher::Ticket ticket = 0;
  Request request;
  Gain gain;
  Done done;
  Host* host = nullptr;
  int attempts = 0;
  Clock::time_point not_before{};  ///< of the next attempt

  // While it is in flight.
  std::string url;                 ///< of the request, or where redirects have led
  int redirects = 0;               ///< that were followed here
  Easy easy;
  HeaderList headers;
  Reply reply;
  std::optional<std::chrono::seconds> retry_after;
  std::size_t most_bytes = 0;
  std::atomic<std::int64_t>* all_received = nullptr;  ///< of all transfers
  std::int64_t received = 0;       ///< bytes of the body, as they came, that are counted there
  bool too_large = false;
  bool not_in_parts = false;       ///< the server sends the whole file instead of the range
  std::string content_range;
};

std::string lower(std::string_view text) {
  std::string out(text);
  std::transform(out.begin(), out.end(), out.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return out;
}

/// Of a URL: scheme, name and port.
std::string host_of(const std::string& url) {
  const std::string shown = lower(public_part(url));
  const std::size_t scheme = shown.find("://");
  return shown.substr(0, scheme == std::string::npos ? scheme : shown.find('/', scheme + 3));
}

/// Whether what a source's headers tell `from` may be told `to`: the same server, or the same by a safer protocol.
bool may_know_headers(const std::string& from, const std::string& to) {
  const std::string source = host_of(from), target = host_of(to);
  constexpr std::string_view kPlain = "http://", kSafe = "https://";
  if (source == target) return true;
  if (!source.starts_with(kPlain) || !target.starts_with(kSafe)) return false;
  const auto name = [](std::string_view host) { return host.substr(0, host.find_last_of(":]") == host.rfind(':') ? host.rfind(':') : host.npos); };
  return name(std::string_view(source).substr(kPlain.size())) == name(std::string_view(target).substr(kSafe.size()));
}

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t\r\n");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t\r\n") - begin + 1);
}

std::optional<std::chrono::seconds> seconds_in(std::string_view text) {
  long long number = 0;
  const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), number);
  constexpr long long kLongest = 10LL * 365 * 86400;
  if (status != std::errc() || number < 0) return std::nullopt;
  return std::chrono::seconds(std::min(number, kLongest));
}

/// Retry-After gives seconds or a date (RFC 9110, 10.2.3).
std::optional<std::chrono::seconds> retry_after_of(const std::string& value) {
  if (const auto seconds = seconds_in(value)) return seconds;
  const std::time_t date = curl_getdate(value.c_str(), nullptr);
  if (date < 0) return std::nullopt;
  return std::chrono::seconds(std::max<std::time_t>(date - std::time(nullptr), 0));
}

/// Counts what has come of the body since it was last called. Compressed bytes count as such.
void count_received(Transfer& transfer) {
  curl_off_t received = 0;
  curl_easy_getinfo(transfer.easy.get(), CURLINFO_SIZE_DOWNLOAD_T, &received);
  if (received > transfer.received) *transfer.all_received += received - std::exchange(transfer.received, received);
}

std::size_t take_body(char* data, std::size_t, std::size_t count, void* user) {
  Transfer& transfer = *static_cast<Transfer*>(user);
  long status = 0;
  curl_easy_getinfo(transfer.easy.get(), CURLINFO_RESPONSE_CODE, &status);
  if (status >= 400) return count;  // of an error's text only the status counts
  count_received(transfer);
  const bool whole = transfer.request.range && status == 200;  // fine if it is no more than the part that was asked for
  const bool too_much = transfer.reply.body.size() + count > transfer.most_bytes;
  if (whole && (too_much || transfer.request.range->offset > 0)) {
    transfer.not_in_parts = true;
    return 0;
  }
  if (too_much) {
    transfer.too_large = true;
    return 0;
  }
  transfer.reply.body.append(data, count);
  return count;
}

std::size_t take_header(char* data, std::size_t, std::size_t count, void* user) {
  Transfer& transfer = *static_cast<Transfer*>(user);
  const std::string_view line(data, count);
  if (line.starts_with("HTTP/")) {  // of a redirect's target: what was said before does not count
    transfer.host->multiplexes = !line.starts_with("HTTP/1");
    transfer.reply = {};
    transfer.received = 0;
    transfer.retry_after.reset();
    transfer.content_range.clear();
  }
  const std::size_t colon = line.find(':');
  if (colon == std::string_view::npos) return count;
  const std::string name = lower(line.substr(0, colon));
  const std::string value(trimmed(line.substr(colon + 1)));
  if (name == "etag") transfer.reply.etag = value;
  if (name == "last-modified") transfer.reply.last_modified = value;
  if (name == "content-type") transfer.reply.content_type = lower(value);
  if (name == "content-range") transfer.content_range = lower(value);
  if (name == "retry-after") transfer.retry_after = retry_after_of(value);
  if (name == "cache-control") {
    const std::string directives = lower(value);
    if (const std::size_t at = directives.find("max-age="); at != std::string::npos) transfer.reply.max_age = seconds_in(std::string_view(directives).substr(at + 8));
    if (directives.find("no-store") != std::string::npos || directives.find("no-cache") != std::string::npos) transfer.reply.max_age = std::chrono::seconds(0);
  }
  return count;
}

/// Whether what came is the part that was asked for; finds the size of the whole file. `Content-Range: bytes 0-99/1234`
/// (RFC 9110, 14.4); a short file may come whole.
bool is_asked_part(Transfer& transfer, long status) {
  const ByteRange& asked = *transfer.request.range;
  Reply& reply = transfer.reply;
  if (status == 200) {
    reply.whole_bytes = reply.body.size();
    return true;
  }
  std::uint64_t first = 0, last = 0, whole = 0;
  const std::string& text = transfer.content_range;
  const char* const end = text.data() + text.size();
  const auto read = [end](const char* at, std::uint64_t& number, char after) {
    const auto [stop, failure] = std::from_chars(at, end, number);
    return failure == std::errc() && (after == 0 ? stop == end : stop != end && *stop == after) ? stop + 1 : nullptr;
  };
  if (!text.starts_with("bytes ")) return false;
  const char* at = read(text.data() + 6, first, '-');
  if (at) at = read(at, last, '/');
  if (!at || !read(at, whole, 0)) return false;
  reply.whole_bytes = whole;
  return first == asked.offset && last >= first && last < whole && reply.body.size() == last - first + 1 &&
         reply.body.size() == std::min(asked.length, whole - first);
}

/// Whether another attempt may go better.
bool is_passing(CURLcode code, long status) {
  if (code != CURLE_OK) {
    return code != CURLE_URL_MALFORMAT && code != CURLE_UNSUPPORTED_PROTOCOL && code != CURLE_PEER_FAILED_VERIFICATION &&
           code != CURLE_SSL_CACERT_BADFILE && code != CURLE_TOO_MANY_REDIRECTS && code != CURLE_WRITE_ERROR;
  }
  return status == 408 || status == 425 || status == 429 || status >= 500;
}

/// The authorities to trust in place of the system's, by the variables that curl and OpenSSL look at too.
std::string certificate_file() {
  for (const char* name : {"CURL_CA_BUNDLE", "SSL_CERT_FILE"}) {
    if (const char* file = std::getenv(name); file != nullptr && *file != 0) return file;
  }
  return {};
}

Error failure_of(const Transfer& transfer, CURLcode code, long status, const FetchOptions& options) {
  const std::string url = public_part(transfer.request.url);
  if (transfer.not_in_parts || (code == CURLE_OK && status == 206)) {
    return {ErrorCode::unsupported, fmt::format("{}: the server does not give the parts of a file that are asked for (HTTP ranges); download the file and "
                                                "give its path", url)};
  }
  if (transfer.too_large) return {ErrorCode::exhausted, fmt::format("{}: the reply is larger than {} MB", url, options.most_bytes >> 20)};
  if (code == CURLE_URL_MALFORMAT || code == CURLE_UNSUPPORTED_PROTOCOL)
    return {ErrorCode::invalid_argument, fmt::format("{}: no URL of http or https", url)};
  if (code == CURLE_SSL_CACERT_BADFILE)
    return {ErrorCode::unsupported, fmt::format("{}: the certificates of {} cannot be read; SSL_CERT_FILE or CURL_CA_BUNDLE names them", url, certificate_file())};
  if (code == CURLE_PEER_FAILED_VERIFICATION) {
    return {ErrorCode::unsupported, fmt::format("{}: the server's certificate is not trusted; if it should be, have SSL_CERT_FILE name a file with the "
                                                "certificate of its authority", url)};
  }
  if (code == CURLE_TOO_MANY_REDIRECTS || (code == CURLE_OK && status >= 300 && status < 400))
    return {ErrorCode::unsupported, fmt::format("{}: leads from one URL to the next, more than {} times", url, kMostRedirects)};
  if (code != CURLE_OK) {
    const bool passing = is_passing(code, status);
    return {passing ? ErrorCode::unavailable : ErrorCode::unsupported,
            fmt::format("{}: {}; is the server there, and the network?", url, curl_easy_strerror(code))};
  }
  if (status == 204 || status == 404 || status == 410) return {ErrorCode::not_found, fmt::format("{}: there is no such file ({})", url, status)};
  if (status == 401 || status == 403)
    return {ErrorCode::unsupported, fmt::format("{}: the server refuses it ({}); check the key or the headers of the source", url, status)};
  if (is_passing(code, status)) return {ErrorCode::unavailable, fmt::format("{}: the server answers {}", url, status)};
  return {ErrorCode::unsupported, fmt::format("{}: the server answers {}", url, status)};
}

/// Where a reply sends the transfer, if it is to be followed here.
std::string redirect_of(const Transfer& transfer, CURLcode code) {
  const char* target = nullptr;
  const bool sent = code == CURLE_OK && !transfer.request.headers.empty() &&
                    curl_easy_getinfo(transfer.easy.get(), CURLINFO_REDIRECT_URL, &target) == CURLE_OK && target != nullptr;
  return sent && transfer.redirects < kMostRedirects ? target : "";
}

}  // namespace

std::string public_part(const std::string& url) {
  std::string shown = url.substr(0, url.find_first_of("?#"));
  const std::size_t scheme = shown.find("://");
  if (scheme == std::string::npos) return shown;
  const std::size_t host = scheme + 3, path = std::min(shown.find('/', host), shown.size());
  const std::size_t user = shown.rfind('@', path);
  if (user != std::string::npos && user >= host) shown.erase(host, user + 1 - host);
  return shown;
}

std::string without_credentials(const std::string& url) {
  std::string shown = public_part(url);
  const std::size_t query = url.find('?');
  if (query == std::string::npos) return shown;
  char joint = '?';
  std::string_view rest = std::string_view(url).substr(query + 1);
  rest = rest.substr(0, rest.find('#'));
  while (!rest.empty()) {
    const std::string_view part = rest.substr(0, rest.find('&'));
    rest.remove_prefix(std::min(part.size() + 1, rest.size()));
    const std::string name = lower(part.substr(0, part.find('=')));
    constexpr const char* kWords[] = {"key", "token", "secret", "pass", "pwd", "sig", "auth", "user", "session", "ticket", "credential"};
    if (std::ranges::any_of(kWords, [&](const char* word) { return name.find(word) != std::string::npos; })) continue;
    shown += joint;
    shown += part;
    joint = '&';
  }
  return shown;
}

struct Fetcher::State {
  explicit State(const FetchOptions& o) : options(o) {}

  const FetchOptions options;
  const std::string certificates = certificate_file();
  CURLM* multi = nullptr;
  std::atomic<std::int64_t> bytes{0};  ///< FetchStats::bytes

  mutable std::mutex mutex;  ///< guards what follows
  std::unordered_map<Ticket, std::unique_ptr<Transfer>> waiting;
  std::unordered_map<std::string, Host> hosts;  ///< all that were ever asked: those of the world's sources
  std::vector<Ticket> to_cancel;
  FetchStats stats;
  Ticket next_ticket = 1;
  bool closing = false;

  // The network thread's own.
  std::unordered_map<CURL*, std::unique_ptr<Transfer>> flying;
  std::minstd_rand random{std::random_device{}()};
  std::jthread thread;

  void run() noexcept;
  bool has_room(const Host& host) const { return host.multiplexes || host.flying < options.most_per_host; }
  std::unique_ptr<Transfer> next_due(Clock::time_point now, Clock::time_point& wake);
  void begin(std::unique_ptr<Transfer> transfer);
  void end(CURL* easy, CURLcode code);
  void cancel_flying();
  void finish(std::unique_ptr<Transfer> transfer, Outcome outcome);
};

/// The waiting transfer of the greatest gain that may begin; `wake`: when the next may. One that curl would let wait for a
/// connection stays here, where its gain counts.
std::unique_ptr<Transfer> Fetcher::State::next_due(Clock::time_point now, Clock::time_point& wake) {
  std::lock_guard lock(mutex);
  auto best = waiting.end();
  double greatest = 0;
  for (auto it = waiting.begin(); it != waiting.end(); ++it) {
    const Transfer& transfer = *it->second;
    if (transfer.not_before > now) {
      wake = std::min(wake, transfer.not_before);
    } else if (!has_room(*transfer.host)) {
      continue;
    } else if (const double gain = *transfer.gain; best == waiting.end() || gain > greatest || (gain == greatest && transfer.ticket < best->second->ticket)) {
      best = it;
      greatest = gain;
    }
  }
  if (best == waiting.end()) return nullptr;
  auto transfer = std::move(best->second);
  waiting.erase(best);
  ++stats.started;
  ++stats.in_flight;
  return transfer;
}

void Fetcher::State::begin(std::unique_ptr<Transfer> transfer) {
  Transfer& t = *transfer;
  t.easy.reset(curl_easy_init());
  t.reply = {};
  t.all_received = &bytes;
  t.received = 0;
  t.retry_after.reset();
  t.content_range.clear();
  t.too_large = t.not_in_parts = false;
  t.most_bytes = options.most_bytes;
  if (t.url.empty()) {
    t.url = t.request.url;
    ++t.attempts;
  }
  CURL* easy = t.easy.get();
  curl_easy_setopt(easy, CURLOPT_URL, t.url.c_str());
  curl_easy_setopt(easy, CURLOPT_PROTOCOLS_STR, "http,https");
  curl_easy_setopt(easy, CURLOPT_REDIR_PROTOCOLS_STR, "http,https");
  // curl would tell every server that it is sent to what the source's headers say: these redirects are followed here.
  curl_easy_setopt(easy, CURLOPT_FOLLOWLOCATION, t.request.headers.empty() ? 1L : 0L);
  curl_easy_setopt(easy, CURLOPT_MAXREDIRS, static_cast<long>(kMostRedirects));
  if (t.request.range) {  // of the bytes as they are: nothing may compress them on the way
    const ByteRange& range = *t.request.range;
    t.most_bytes = static_cast<std::size_t>(std::min<std::uint64_t>(t.most_bytes, range.length));
    curl_easy_setopt(easy, CURLOPT_RANGE, fmt::format("{}-{}", range.offset, range.offset + range.length - 1).c_str());
  } else {
    curl_easy_setopt(easy, CURLOPT_ACCEPT_ENCODING, "");  // all that curl can undo
  }
  curl_easy_setopt(easy, CURLOPT_USERAGENT, "tellurion/" TELLURION_VERSION);
  curl_easy_setopt(easy, CURLOPT_HTTP_VERSION, static_cast<long>(CURL_HTTP_VERSION_2TLS));
  curl_easy_setopt(easy, CURLOPT_PIPEWAIT, 0L);
  curl_easy_setopt(easy, CURLOPT_NOSIGNAL, 1L);
  curl_easy_setopt(easy, CURLOPT_CONNECTTIMEOUT_MS, static_cast<long>(options.connect_timeout.count()));
  curl_easy_setopt(easy, CURLOPT_LOW_SPEED_LIMIT, 1L);
  curl_easy_setopt(easy, CURLOPT_LOW_SPEED_TIME, static_cast<long>(std::max<std::int64_t>(options.stall_timeout.count() / 1000, 1)));
  curl_easy_setopt(easy, CURLOPT_WRITEFUNCTION, take_body);
  curl_easy_setopt(easy, CURLOPT_WRITEDATA, &t);
  curl_easy_setopt(easy, CURLOPT_HEADERFUNCTION, take_header);
  curl_easy_setopt(easy, CURLOPT_HEADERDATA, &t);
  t.headers.reset();
  if (!t.request.etag.empty()) t.headers.reset(curl_slist_append(nullptr, ("If-None-Match: " + t.request.etag).c_str()));
  const bool may_know = may_know_headers(t.request.url, t.url);
  for (const std::string& header : t.request.headers) {
    if (may_know) t.headers.reset(curl_slist_append(t.headers.release(), header.c_str()));
  }
  if (t.headers) curl_easy_setopt(easy, CURLOPT_HTTPHEADER, t.headers.get());
  if (!certificates.empty()) curl_easy_setopt(easy, CURLOPT_CAINFO, certificates.c_str());
  ++t.host->flying;
  flying.emplace(easy, std::move(transfer));
  curl_multi_add_handle(multi, easy);
}

void Fetcher::State::finish(std::unique_ptr<Transfer> transfer, Outcome outcome) {
  {
    std::lock_guard lock(mutex);
    if (outcome) ++stats.finished;
    else if (outcome.error().code == ErrorCode::cancelled) ++stats.cancelled;
    else if (outcome.error().code == ErrorCode::not_found) ++stats.finished;
    else ++stats.failed;
  }
  transfer->done(std::move(outcome));
}

/// Takes a transfer that ended out of curl: it is answered, or waits for its next attempt.
void Fetcher::State::end(CURL* easy, CURLcode code) {
  const auto found = flying.find(easy);
  auto transfer = std::move(found->second);
  flying.erase(found);
  --transfer->host->flying;
  curl_multi_remove_handle(multi, easy);
  long status = 0;
  curl_easy_getinfo(easy, CURLINFO_RESPONSE_CODE, &status);
  if (status < 400) count_received(*transfer);
  if (std::string target = redirect_of(*transfer, code); !target.empty()) {
    transfer->url = std::move(target);
    ++transfer->redirects;
    return begin(std::move(transfer));
  }
  transfer->url.clear();
  transfer->redirects = 0;
  transfer->easy.reset();
  bool again = is_passing(code, status) && !transfer->too_large && !transfer->not_in_parts && transfer->attempts < options.most_attempts;
  auto pause = std::chrono::duration_cast<std::chrono::milliseconds>(
      options.first_pause * (1 << (transfer->attempts - 1)) * std::uniform_real_distribution<>(0.5, 1.5)(random));
  if (transfer->retry_after) {
    again = again && *transfer->retry_after <= options.longest_pause;
    pause = std::max<std::chrono::milliseconds>(pause, *transfer->retry_after);
  }
  {
    std::lock_guard lock(mutex);
    --stats.in_flight;
    if (again && !closing) {
      transfer->not_before = Clock::now() + pause;
      const Ticket ticket = transfer->ticket;
      waiting.emplace(ticket, std::move(transfer));
      return;
    }
  }
  transfer->reply.not_modified = status == 304;
  const bool sent = transfer->request.range ? (status == 200 || status == 206) && is_asked_part(*transfer, status) : status == 200;
  if (code == CURLE_OK && (sent || status == 304)) {
    Outcome outcome = std::move(transfer->reply);
    finish(std::move(transfer), std::move(outcome));
  } else {
    Outcome outcome = failure_of(*transfer, code, status, options);
    outcome.retry_after = transfer->retry_after;
    finish(std::move(transfer), std::move(outcome));
  }
}

void Fetcher::State::cancel_flying() {
  std::vector<Ticket> tickets;
  {
    std::lock_guard lock(mutex);
    tickets.swap(to_cancel);
  }
  for (const Ticket ticket : tickets) {
    std::unique_ptr<Transfer> transfer;
    const auto found = std::find_if(flying.begin(), flying.end(), [&](const auto& flight) { return flight.second->ticket == ticket; });
    if (found != flying.end()) {
      transfer = std::move(found->second);
      flying.erase(found);
      --transfer->host->flying;
      curl_multi_remove_handle(multi, transfer->easy.get());
      transfer->easy.reset();
      std::lock_guard lock(mutex);
      --stats.in_flight;
    } else {
      std::lock_guard lock(mutex);
      const auto unsent = waiting.find(ticket);
      if (unsent == waiting.end()) continue;  // it is over
      transfer = std::move(unsent->second);
      waiting.erase(unsent);
    }
    const std::string url = public_part(transfer->request.url);
    finish(std::move(transfer), Error{ErrorCode::cancelled, url});
  }
}

void Fetcher::State::run() noexcept {
  for (;;) {
    cancel_flying();
    const auto now = Clock::now();
    auto wake = now + std::chrono::seconds(1);
    while (static_cast<int>(flying.size()) < options.most_transfers) {
      auto transfer = next_due(now, wake);
      if (!transfer) break;
      begin(std::move(transfer));
    }
    {
      std::lock_guard lock(mutex);
      if (closing) break;
    }
    int running = 0;
    curl_multi_perform(multi, &running);
    int left = 0;
    bool ended = false;
    while (const CURLMsg* message = curl_multi_info_read(multi, &left)) {
      if (message->msg != CURLMSG_DONE) continue;
      end(message->easy_handle, message->data.result);
      ended = true;
    }
    if (ended) continue;
    const auto rest = std::chrono::duration_cast<std::chrono::milliseconds>(wake - Clock::now()).count();
    curl_multi_poll(multi, nullptr, 0, static_cast<int>(std::clamp<std::int64_t>(rest, 0, 1000)), nullptr);
  }
  // All that is left ends as cancelled.
  std::vector<std::unique_ptr<Transfer>> left;
  for (auto& [easy, transfer] : flying) {
    curl_multi_remove_handle(multi, easy);
    left.push_back(std::move(transfer));
  }
  flying.clear();
  {
    std::lock_guard lock(mutex);
    for (auto& [ticket, transfer] : waiting) left.push_back(std::move(transfer));
    waiting.clear();
  }
  for (auto& transfer : left) {
    transfer->easy.reset();
    const std::string url = public_part(transfer->request.url);
    finish(std::move(transfer), Error{ErrorCode::cancelled, url});
  }
}

Fetcher::Fetcher(const FetchOptions& options) : state_(std::make_unique<State>(options)) {
  static std::once_flag once;
  std::call_once(once, [] { curl_global_init(CURL_GLOBAL_DEFAULT); });
  state_->multi = curl_multi_init();
  curl_multi_setopt(state_->multi, CURLMOPT_MAX_HOST_CONNECTIONS, static_cast<long>(options.most_per_host));
  curl_multi_setopt(state_->multi, CURLMOPT_MAX_TOTAL_CONNECTIONS, static_cast<long>(options.most_transfers));
  // Else curl keeps four for every transfer under way and closes them when there are few.
  curl_multi_setopt(state_->multi, CURLMOPT_MAXCONNECTS, static_cast<long>(2 * options.most_transfers));
  curl_multi_setopt(state_->multi, CURLMOPT_PIPELINING, static_cast<long>(CURLPIPE_MULTIPLEX));
  state_->thread = std::jthread([state = state_.get()] { state->run(); });
}

Fetcher::~Fetcher() {
  {
    std::lock_guard lock(state_->mutex);
    state_->closing = true;
  }
  curl_multi_wakeup(state_->multi);
  state_->thread.join();
  curl_multi_cleanup(state_->multi);
}

Fetcher::Ticket Fetcher::start(Request request, Gain gain, Done done) {
  auto transfer = std::make_unique<Transfer>();
  transfer->request = std::move(request);
  transfer->gain = std::move(gain);
  transfer->done = std::move(done);
  Ticket ticket = 0;
  {
    std::lock_guard lock(state_->mutex);
    ticket = transfer->ticket = state_->next_ticket++;
    if (!state_->closing) {
      transfer->host = &state_->hosts[host_of(transfer->request.url)];
      state_->waiting.emplace(ticket, std::move(transfer));
      curl_multi_wakeup(state_->multi);
      return ticket;
    }
  }
  transfer->done(Error{ErrorCode::cancelled, public_part(transfer->request.url)});
  return ticket;
}

void Fetcher::cancel(Ticket ticket) {
  {
    std::lock_guard lock(state_->mutex);
    state_->to_cancel.push_back(ticket);
  }
  curl_multi_wakeup(state_->multi);
}

FetchStats Fetcher::stats() const {
  std::lock_guard lock(state_->mutex);
  FetchStats stats = state_->stats;
  stats.bytes = state_->bytes;
  stats.waiting = static_cast<int>(state_->waiting.size());
  return stats;
}

}  // namespace tellurion::fetch
