#include "fetch/fetch_now.h"

#include <future>
#include <memory>
#include <variant>

#include <fmt/format.h>

namespace tellurion::fetch {
namespace {

/// Whether it is over before `deadline`.
bool over_by(Arrival& arrival, std::chrono::steady_clock::time_point deadline) {
  const auto over = std::make_shared<std::promise<void>>();
  const std::future<void> ended = over->get_future();
  arrival.then([over] { over->set_value(); });
  return ended.wait_until(deadline) == std::future_status::ready;
}

}  // namespace

Result<std::string> fetch_now(ByteStore& store, const Request& request, std::chrono::milliseconds patience) {
  const auto deadline = std::chrono::steady_clock::now() + patience;
  for (;;) {
    const Asked asked = store.ask(request);
    if (const auto* error = std::get_if<Error>(&asked)) return *error;
    if (const auto* file = std::get_if<File>(&asked)) {
      if (file->bytes) return *file->bytes;
      return Error{ErrorCode::not_found, fmt::format("{}: there is no such file; is the URL right?", public_part(request.url))};
    }
    if (!over_by(*std::get<std::shared_ptr<Arrival>>(asked), deadline))
      return Error{ErrorCode::unavailable, fmt::format("{}: did not come within {} s; is the server there, and the network?",
                                                       public_part(request.url), std::chrono::duration<double>(patience).count())};
  }
}

}  // namespace tellurion::fetch
