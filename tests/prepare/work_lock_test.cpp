#include "prepare/work_lock.h"

#include <optional>

#include <doctest/doctest.h>
#include <fmt/format.h>
#include <unistd.h>

using namespace tellurion;
using prepare::WorkLock;

TEST_CASE("WorkLock: one run of all, or several of different shards") {
  const auto folder = std::filesystem::temp_directory_path() / fmt::format("tellurion_lock_{}", getpid());
  std::filesystem::create_directories(folder);
  {
    std::optional<Result<WorkLock>> first = WorkLock::whole(folder);
    REQUIRE(*first);
    const auto second = WorkLock::whole(folder);
    REQUIRE_FALSE(second);
    CHECK(second.error().code == ErrorCode::unavailable);
    CHECK(second.error().message.find(folder.string()) != std::string::npos);
    CHECK_FALSE(WorkLock::shard(folder, 0, 2));
    first.reset();
    const auto one = WorkLock::shard(folder, 0, 2), other = WorkLock::shard(folder, 1, 2);
    CHECK(one);
    CHECK(other);
    CHECK_FALSE(WorkLock::shard(folder, 1, 2));
    CHECK_FALSE(WorkLock::whole(folder));
  }
  CHECK(WorkLock::whole(folder));
  CHECK_MESSAGE(WorkLock::whole(folder / "none"), "where nothing can be locked work goes on");
  std::filesystem::remove_all(folder);
}
