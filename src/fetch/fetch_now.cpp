#include "fetch/fetch_now.h"

#include <memory>
#include <utility>
#include <variant>

#include <fmt/format.h>

namespace tellurion::fetch {

Result<File> wait_for_file(const std::function<Asked()>& ask, const std::string& name, std::chrono::milliseconds patience) {
  using Clock = std::chrono::steady_clock;
  const auto deadline = Clock::now() + patience;
  for (;;) {
    Asked asked = ask();
    if (auto* error = std::get_if<Error>(&asked)) return std::move(*error);
    if (auto* file = std::get_if<File>(&asked)) return std::move(*file);
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now());
    if (left.count() <= 0 || !std::get<std::shared_ptr<Arrival>>(asked)->wait_for(left))
      return Error{ErrorCode::unavailable, fmt::format("{}: no answer within {} s; is the server there, and the network?", name,
                                                       std::chrono::duration<double>(patience).count())};
  }
}

Result<File> fetch_file_now(ByteStore& store, const Request& request, std::chrono::milliseconds patience) {
  const std::string shown = public_part(request.url);
  Result<File> file = wait_for_file([&] { return store.ask(request, kAwaitedGain); }, shown, patience);
  if (file && !file->bytes) return Error{ErrorCode::not_found, fmt::format("{}: there is no such file; is the URL right?", shown)};
  return file;
}

Result<std::string> fetch_now(ByteStore& store, const Request& request, std::chrono::milliseconds patience) {
  const Result<File> file = fetch_file_now(store, request, patience);
  if (!file) return file.error();
  return *file->bytes;
}

}  // namespace tellurion::fetch
