// SPDX-License-Identifier: GPL-2.0-or-later

#include <atomic>
#include <mutex>

#include "messages/report.hh"
#include "models/model_type_names.hh"
#include "stage.hh"
#include "stage_config.hh"

namespace Stg {

namespace {

std::atomic<bool> init_done{false};
std::mutex init_mutex;

void InitAlone(int* argc, char** argv[]) {
  World::args.clear();
  if (argc && *argc > 0 && argv && *argv)
    for (int i = 0; i < *argc; i++) World::args.push_back((*argv)[i]);
  RandomStream::SeedThreads(World::run_options.seed);
  RegisterModels();
  init_done = true;
}

}  // namespace

void Init(int* argc, char** argv[]) {
  const std::lock_guard<std::mutex> lock(init_mutex);
  InitAlone(argc, argv);
}

void World::InitIfNotDone() {
  const std::lock_guard<std::mutex> lock(init_mutex);
  if (init_done) return;
  messages::Warn("a World was created before Init(); Init() is called now");
  InitAlone(nullptr, nullptr);
}

bool InitDone() { return init_done; }
const char* Version() { return kVersion; }
unsigned int FullVersion() { return 50000; }

void RegisterModels() { NameModelTypes(); }

}  // namespace Stg
