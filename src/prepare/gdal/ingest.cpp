#include "prepare/ingest.h"

#include <algorithm>
#include <atomic>
#include <fstream>
#include <iterator>
#include <mutex>
#include <set>
#include <system_error>
#include <utility>

#include <cpl_conv.h>
#include <fmt/format.h>

#include "base/hash.h"
#include "prepare/chunk_file.h"
#include "prepare/gdal/block_codec.h"
#include "prepare/gdal/chunk_worker.h"
#include "prepare/gdal/inputs.h"
#include "prepare/gdal/join.h"
#include "prepare/gdal/output_errors.h"
#include "prepare/parallel.h"
#include "prepare/work_lock.h"
#include "prepare/write_whole.h"
#include "source/gdal/gdal_runtime.h"
#include "source/gdal/gdal_source.h"

namespace tellurion::prepare {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kProgramBytes = std::size_t{96} << 20;  ///< of the program, its libraries and GDAL's drivers
constexpr std::size_t kLeastCacheBytes = std::size_t{16} << 20;
constexpr const char* kPlanFile = "plan.json";
constexpr const char* kJoinedFile = "joined";

std::string read_text(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// What stands in the work folder once a plan has been joined into a file, which has not been touched since.
std::string joined_text(const OutputPlan& plan, const fs::path& out) {
  std::error_code error;
  const auto size = fs::file_size(out, error);
  const auto time = fs::last_write_time(out, error);
  return error ? "" : fmt::format("{:016x} {} {}\n", fnv1a(to_text(plan)), size, time.time_since_epoch().count());
}

bool is_joined(const OutputPlan& plan, const fs::path& out, const fs::path& folder) {
  const std::string text = joined_text(plan, out);
  return !text.empty() && read_text(folder / kJoinedFile) == text;
}

/// Removes what earlier plans and runs that were killed have left in a work folder.
void remove_stale(const OutputPlan& plan, const fs::path& folder) {
  std::set<std::string> wanted;
  for (std::size_t i = 0; i < plan.chunk_hashes.size(); ++i) {
    if (!plan.chunk_hashes[i].empty()) wanted.insert(chunk_file_name(plan, static_cast<int>(i)));
  }
  std::error_code error;
  std::vector<fs::path> stale;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    if (name.ends_with(".part") || (name.starts_with("chunk-") && name.ends_with(".blocks") && !wanted.contains(name))) stale.push_back(entry.path());
  }
  for (const fs::path& file : stale) fs::remove(file, error);
}

Result<IngestReport> join(const OutputPlan& plan, const std::vector<fs::path>& folders, const fs::path& out, int workers, IngestReport report) {
  const Result<std::vector<fs::path>> chunks = find_chunks(plan, folders);
  if (!chunks) return chunks.error();
  const Result<std::uint64_t> bytes = join_chunks(plan, *chunks, folders.front(), out, workers);
  if (!bytes) return bytes.error();
  if (Result<void> kept = write_whole(folders.front() / kJoinedFile, joined_text(plan, out)); !kept) return kept.error();
  report.joined = true;
  report.file_bytes = *bytes;
  return report;
}

/// The error table of what has been joined.
Result<IngestReport> measure(const fs::path& out, const fs::path& folder, std::optional<bool> wanted, std::size_t memory_bytes, int workers, const IngestWatch& watch, IngestReport report) {
  const std::size_t left = memory_bytes - std::min(memory_bytes, kProgramBytes);
  const Result<bool> made = make_error_table(out, folder, {wanted, left, workers}, watch);
  if (!made) return made.error();
  report.measured = *made;
  return report;
}

IngestReport report_of(const OutputPlan& plan) {
  IngestReport report;
  report.width = plan.width;
  report.height = plan.height;
  report.levels = plan.level_count();
  return report;
}

/// How many workers the memory is enough for. Errors: exhausted.
Result<int> affordable_workers(const Mosaic& mosaic, const IngestOptions& options) {
  const std::size_t one = worker_bytes(mosaic.plan(), mosaic.repair()), shared = mosaic.repair().shared_bytes(), least = kProgramBytes + shared + kLeastCacheBytes + one;
  if (options.memory_bytes < least) {
    return {ErrorCode::exhausted, fmt::format("this needs more memory than {} MB; say --memory {} or more, or --block 256", options.memory_bytes >> 20, (least >> 20) + 1)};
  }
  const std::size_t cache = std::clamp(options.memory_bytes / 8, kLeastCacheBytes, kLeastCacheBytes + options.memory_bytes - least);
  source::configure_gdal(cache);
  return std::max(1, static_cast<int>(std::min<std::size_t>(static_cast<std::size_t>(options.workers), (options.memory_bytes - kProgramBytes - shared - cache) / one)));
}

/// The chunks of the shard that are not done. A damaged one is not.
std::vector<int> chunks_to_make(const OutputPlan& plan, const IngestOptions& options, const fs::path& folder, IngestReport& report) {
  std::vector<int> wanted;
  int number = 0;
  for (std::size_t i = 0; i < plan.chunk_hashes.size(); ++i) {
    if (plan.chunk_hashes[i].empty() || number++ % options.shards != options.shard) continue;
    ++report.chunks;
    if (!read_chunk_index(folder / chunk_file_name(plan, static_cast<int>(i)))) wanted.push_back(static_cast<int>(i));
  }
  return wanted;
}

Result<void> make_chunks(const Mosaic& mosaic, const std::vector<int>& wanted, int workers, const fs::path& folder, const IngestWatch& watch) {
  const OutputPlan& plan = mosaic.plan();
  std::vector<std::optional<ChunkWorker>> made(static_cast<std::size_t>(workers));
  std::mutex mutex;
  IngestProgress progress;
  const auto pixels_of = [&](int index) {
    const Chunk chunk = chunk_of(plan, index);
    return static_cast<std::uint64_t>(chunk.width) * static_cast<std::uint64_t>(chunk.height);
  };
  for (const int index : wanted) progress.all_pixels += pixels_of(index);
  return for_each_item(static_cast<int>(wanted.size()), workers, [&](int number, int item) -> Result<void> {
    auto& worker = made[static_cast<std::size_t>(number)];
    if (!worker) {
      Result<ChunkWorker> created = ChunkWorker::create(mosaic, folder);
      if (!created) return created.error();
      worker.emplace(std::move(*created));
    }
    const int index = wanted[static_cast<std::size_t>(item)];
    if (Result<void> done = worker->make(index); !done) return done;
    const std::lock_guard lock(mutex);
    progress.pixels += pixels_of(index);
    progress.bytes += pixels_of(index) * plan.layout.pixel_bytes();
    if (watch && !watch(progress)) return {ErrorCode::cancelled, "stopped; the same command goes on from there"};
    return {};
  });
}

}  // namespace

fs::path work_folder(const fs::path& out) { return fs::path(out) += ".work"; }

Result<IngestReport> ingest(const IngestOptions& options, const IngestWatch& watch) {
  source::configure_gdal(kLeastCacheBytes);
  if (options.compress) {
    if (Result<void> known = check_codec(*options.compress); !known) return known.error();
  }
  const Result<Mosaic> mosaic = Mosaic::create(options);
  if (!mosaic) return mosaic.error();
  const OutputPlan& plan = mosaic->plan();
  const fs::path folder = work_folder(options.out);
  IngestReport report = report_of(plan);
  std::error_code error;
  if (options.shards == 1 && is_joined(plan, options.out, folder)) {
    report.file_bytes = fs::file_size(options.out, error);
    const Result<WorkLock> lock = WorkLock::whole(folder);
    if (!lock) return lock.error();
    return measure(options.out, folder, options.error_table, options.memory_bytes, options.workers, watch, report);
  }
  const Result<int> workers = affordable_workers(*mosaic, options);
  if (!workers) return workers.error();
  fs::create_directories(folder, error);
  if (error) return {ErrorCode::unavailable, fmt::format("{} cannot be made: {}; is there a folder, and is it writable?", folder.string(), error.message())};
  const Result<WorkLock> lock = options.shards > 1 ? WorkLock::shard(folder, options.shard, options.shards) : WorkLock::whole(folder);
  if (!lock) return lock.error();
  if (read_text(folder / kPlanFile) != to_text(plan)) {
    if (Result<void> kept = write_whole(folder / kPlanFile, to_text(plan)); !kept) return kept.error();
  }
  const std::vector<int> wanted = chunks_to_make(plan, options, folder, report);
  report.chunks_made = static_cast<int>(wanted.size());
  if (Result<void> made = make_chunks(*mosaic, wanted, *workers, folder, watch); !made) return made.error();
  if (options.shards > 1) return report;
  const Result<IngestReport> joined = join(plan, {folder}, options.out, *workers, report);
  if (!joined) return joined;
  remove_stale(plan, folder);
  return measure(options.out, folder, options.error_table, options.memory_bytes, options.workers, watch, *joined);
}

Result<IngestReport> merge(const MergeOptions& options, const IngestWatch& watch) {
  const fs::path& out = options.out;
  std::vector<fs::path> folders = options.folders;
  if (folders.empty()) folders.push_back(work_folder(out));
  source::configure_gdal(kLeastCacheBytes);
  std::string text;
  std::vector<WorkLock> locks;
  for (const fs::path& folder : folders) {
    const std::string its = read_text(folder / kPlanFile);
    if (its.empty()) return {ErrorCode::not_found, fmt::format("{}: holds no chunks; shards of `tellurion ingest` make them", folder.string())};
    if (!text.empty() && its != text) return {ErrorCode::invalid_argument, fmt::format("{} and {} come of different work: the same command and inputs are needed everywhere", folders.front().string(), folder.string())};
    text = its;
    Result<WorkLock> lock = WorkLock::whole(folder);
    if (!lock) return lock.error();
    locks.push_back(std::move(*lock));
  }
  const Result<OutputPlan> plan = plan_from_text(text);
  if (!plan) return {plan.error().code, fmt::format("{}: {}", (folders.front() / kPlanFile).string(), plan.error().message)};
  IngestReport report = report_of(*plan);
  report.chunks = static_cast<int>(std::count_if(plan->chunk_hashes.begin(), plan->chunk_hashes.end(), [](const std::string& hash) { return !hash.empty(); }));
  if (is_joined(*plan, out, folders.front())) {
    std::error_code error;
    report.file_bytes = fs::file_size(out, error);
  } else {
    const Result<IngestReport> joined = join(*plan, folders, out, options.workers, report);
    if (!joined) return joined;
    report = *joined;
  }
  return measure(out, folders.front(), options.error_table, options.memory_bytes, options.workers, watch, report);
}

}  // namespace tellurion::prepare
