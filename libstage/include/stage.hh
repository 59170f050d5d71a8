// SPDX-License-Identifier: GPL-2.0-or-later
//
// Stage 5: simulates crowds of mobile robots in the plane. The one header that clients include.
//
// A program: Stg::Init(&argc, &argv); Stg::World world; world.Load("my.world"); world.Start();
// Stg::World::Run(). A controller: a shared library that exports
// extern "C" int Init(Stg::Model *, Stg::CtrlArgs *), named by a `ctrl` property of a model.
//
// Compiles as C++11 and later; tested as C++11 to C++20.

#ifndef STG_H
#define STG_H

// Clients rely on these.
#include <assert.h>
#include <libgen.h>
#include <pthread.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/time.h>
#include <sys/types.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <list>
#include <map>
#include <queue>
#include <set>
#include <string>
#include <vector>

#include "geometry/color.hh"
#include "geometry/geometry.hh"
#include "geometry/image_polygons.hh"
#include "geometry/random.hh"
#include "insight/explain.hh"
#include "messages/log.hh"
#include "models/actuator.hh"
#include "models/ancestor.hh"
#include "models/blinkenlight.hh"
#include "models/blobfinder.hh"
#include "models/bumper.hh"
#include "models/camera.hh"
#include "models/camera_view.hh"
#include "models/fiducial.hh"
#include "models/flag.hh"
#include "models/gripper.hh"
#include "models/lightindicator.hh"
#include "models/log_entry.hh"
#include "models/messages.hh"
#include "models/model.hh"
#include "models/model_type.hh"
#include "models/position.hh"
#include "models/power_pack.hh"
#include "models/ranger.hh"
#include "models/state_exchange.hh"
#include "models/visualizer.hh"
#include "models/wifi.hh"
#include "whatif/branches.hh"
#include "whatif/consequence_engine.hh"
#include "world/ray_caster.hh"
#include "world/snapshot.hh"
#include "world/statistics.hh"
#include "world/world.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

/// Call it first. Keeps the arguments in World::args and registers the model types. Leaves the
/// arguments and the locale of the process as they are; may be called again. A World that is made
/// before it warns and calls it without arguments.
void Init(int* argc, char** argv[]);
bool InitDone();
/// "5.0.0"
const char* Version();
/// 50000: major * 10000 + minor * 100 + patch
unsigned int FullVersion();
/// Fills Model::name_map with the types that are registered, the built-in ones among them. Init()
/// does.
void RegisterModels();

/// About the program.
extern const char COPYRIGHT[], AUTHORS[], WEBSITE[], DESCRIPTION[], LICENSE[];

/// A fiducial_return that is none.
enum { FiducialNone = 0 };

typedef struct {
  int enabled;
  Pose pose;
  meters_t size;
  Color color;
  msec_t period;
  double duty_cycle;
} blinkenlight_t;

/// Removes all elements equal to `thing` from a sequence.
template <class T, class C>
void EraseAll(T thing, C& cont) {
  cont.erase(std::remove(cont.begin(), cont.end(), thing), cont.end());
}

}  // namespace Stg

// The window, where it is built and the headers of FLTK are there. Define STAGE_WITHOUT_WINDOW for
// clients that need none and want to compile faster.
#if !defined(STAGE_WITHOUT_WINDOW) && __has_include("window/world_gui.hh") && \
                                                    __has_include(<FL/Fl_Gl_Window.H>)
#include "window/world_gui.hh"
#endif

#endif
