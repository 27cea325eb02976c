// tellurion cache: what is kept on disk between runs.
#include "commands.h"

#include <memory>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "options.h"

namespace tellurion::apps {
namespace {

std::string megabytes(std::int64_t bytes) { return fmt::format("{:.1f} MB", static_cast<double>(bytes) / (1 << 20)); }

int info(const std::filesystem::path& folder) {
  const auto kept = globe::kept_files(folder);
  if (!kept) return report(kept.error());
  fmt::print("folder        {}\n", folder.string());
  fmt::print("from servers  {} files, {}; of {} more it is known that there is none\n", kept->files - kept->missing, megabytes(kept->file_bytes), kept->missing);
  fmt::print("error tables  {}\n", megabytes(kept->table_bytes));
  fmt::print("unpacked      {}\n", megabytes(kept->unpacked_bytes));
  return kDone;
}

int verify(const std::filesystem::path& folder) {
  const auto dropped = globe::verify_kept_files(folder);
  if (!dropped) return report(dropped.error());
  fmt::print("{}\n", *dropped == 0 ? "every file is as it was written" : fmt::format("{} damaged files were dropped; they will be fetched again", *dropped));
  return kDone;
}

int clear(const std::filesystem::path& folder) {
  if (const auto cleared = globe::clear_kept_files(folder); !cleared) return report(cleared.error());
  fmt::print("{} is empty\n", folder.string());
  return kDone;
}

}  // namespace

void add_cache(CLI::App& app, Run& run) {
  CLI::App* command = app.add_subcommand("cache", "what is kept on disk: tiles of servers, error tables, unpacked rasters");
  command->require_subcommand(1);
  auto options = std::make_shared<Options>();
  const auto add = [&](const char* name, const char* help, int (*work)(const std::filesystem::path&)) {
    CLI::App* sub = command->add_subcommand(name, help);
    add_disk_cache(*sub, *options);
    sub->callback([options, work, &run] { run = [options, work] { return work(options->disk_cache); }; });
  };
  add("info", "how much there is", info);
  add("verify", "read all of it and drop what is damaged", verify);
  add("clear", "remove all of it", clear);
  add_prefetch(*command, run);
}

}  // namespace tellurion::apps
