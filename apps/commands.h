// The program's subcommands. Each adds itself to the command line and sets `run` when it is the one asked for.
#pragma once

#include <functional>

namespace CLI {
class App;
}

namespace tellurion::apps {

using Run = std::function<int()>;

void add_render(CLI::App& app, Run& run);
void add_fly(CLI::App& app, Run& run);
void add_height(CLI::App& app, Run& run);
void add_info(CLI::App& app, Run& run);
void add_ingest(CLI::App& app, Run& run);
void add_world_files(CLI::App& app, Run& run);
void add_cache(CLI::App& app, Run& run);
/// Under `cache`.
void add_prefetch(CLI::App& cache, Run& run);
void add_bench(CLI::App& app, Run& run);
void add_view(CLI::App& app, Run& run);

}  // namespace tellurion::apps
