// SPDX-License-Identifier: GPL-2.0-or-later
//
// A controller for tests whose first argument selects an action in Init().
#include <sstream>
#include <stdexcept>
#include <string>

#include "stage.hh"
#include "worldfile/worldfile.hh"

namespace {

bool LoadAnother(Stg::World* world) {
  std::istringstream text("model( name \"another\" )");
  return world->Load(text, "another.world");
}

}  // namespace

extern "C" int Init(Stg::Model* mod, Stg::CtrlArgs* args) {
  std::istringstream words(args->worldfile);
  std::string own_name, what;
  words >> own_name >> what;
  Stg::World* world = mod->GetWorld();
  if (what == "throw_number") throw 42;
  if (what == "throw_text") throw "some text";
  if (what == "throw_error") throw std::runtime_error("out of order");
  if (what == "throw_own") throw Stg::Pose();
  if (what == "unload") world->UnLoad();
  if (what == "load") LoadAnother(world);
  if (what == "load_itself") world->Load(world->GetWorldFile()->filename);
  if (what == "reload") world->Reload();
  if (what == "save") world->Save("/nonexistent/saved.world");
  if (what == "delete_model") delete mod;
  if (what == "delete_world") {
    delete world;
    return 0;
  }
  if (what == "unload_and_throw") {
    world->UnLoad();
    throw 42;
  }
  return 0;
}
