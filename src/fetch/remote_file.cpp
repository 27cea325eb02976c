#include "fetch/remote_file.h"

#include <utility>
#include <variant>

#include <fmt/format.h>

#include "fetch/fetch_now.h"

namespace tellurion::fetch {

Result<std::shared_ptr<const RemoteFile>> RemoteFile::open(std::shared_ptr<ByteStore> store, const std::string& url, std::vector<std::string> headers,
                                                           std::size_t head_bytes, std::chrono::milliseconds patience) {
  std::shared_ptr<RemoteFile> made(new RemoteFile);
  made->store_ = std::move(store);
  made->url_ = url;
  made->headers_ = std::move(headers);
  made->name_ = without_credentials(url);
  made->head_key_ = fmt::format("{}#0+{}", made->name_, head_bytes);
  const Request request{url, made->headers_, made->head_key_, {}, 0, ByteRange{0, head_bytes}};
  Result<File> file = fetch_file_now(*made->store_, request, patience);
  if (!file) return file.error();
  made->head_ = file->bytes;
  made->etag_ = file->etag;
  made->size_ = file->whole_bytes;
  if (made->size_ < made->head_->size()) {  // kept by something else under this name
    made->store_->reject(made->head_key_, made->name_);
    return Error{ErrorCode::unavailable, fmt::format("{}: its first bytes were no part of a file; try again", made->name_)};
  }
  return std::shared_ptr<const RemoteFile>(std::move(made));
}

std::string RemoteFile::revision() const { return fmt::format("{}|{}|{}", name_, etag_, size_); }

Request RemoteFile::request_for(const ByteRange& part) const {
  return {url_, headers_, fmt::format("{}#{}+{}@{}", name_, part.offset, part.length, etag_), {}, 0, part};
}

Asked RemoteFile::ask(const ByteRange& part, double gain) const {
  if (part.offset > size_ || part.length > size_ - part.offset || part.length == 0)
    return Error{ErrorCode::corrupt, fmt::format("{}: its index names bytes {} to {}, but it has {}; it is cut off or damaged", name_, part.offset,
                                                 part.offset + part.length, size_)};
  if (part.offset + part.length <= head_->size())
    return File{std::make_shared<const std::string>(head_->substr(static_cast<std::size_t>(part.offset), static_cast<std::size_t>(part.length))), {}, etag_, size_};
  const Request request = request_for(part);
  Asked asked = store_->ask(request, gain);
  const File* file = std::get_if<File>(&asked);
  if (!file || (file->bytes && file->etag == etag_ && file->whole_bytes == size_)) return asked;
  const std::string why = fmt::format("{}: has changed on the server since it was opened; open it again", name_);
  store_->reject(request.key, why);
  store_->reject(head_key_, why);
  return Error{ErrorCode::unavailable, why};
}

Result<std::shared_ptr<const std::string>> RemoteFile::wait_for(const ByteRange& part, std::chrono::milliseconds patience) const {
  Result<File> file = wait_for_file([&] { return ask(part, kAwaitedGain); }, name_, patience);
  if (!file) return file.error();
  return std::move(file->bytes);
}

void RemoteFile::reject(const ByteRange& part, const std::string& why) const {
  const bool in_head = part.offset < head_->size();
  store_->reject(in_head ? head_key_ : request_for(part).key, why);
  if (in_head && part.offset + part.length > head_->size()) store_->reject(request_for(part).key, why);
}

}  // namespace tellurion::fetch
