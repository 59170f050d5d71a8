// SPDX-License-Identifier: GPL-2.0-or-later
//
// Stage 5: simulates crowds of mobile robots in the plane. Clients include this header alone.
//
// A program calls Stg::Init(&argc, &argv); Stg::World world; world.Load("my.world"); world.Start();
// Stg::World::Run(). A controller is a shared library that exports extern "C" int Init(Stg::Model
// *, Stg::CtrlArgs *) and is named by a model's `ctrl` property.
//
// Compiles as C++11 and later; tested with C++11 to C++20.

#ifndef STG_H
#define STG_H

// Included for clients, which rely on these headers.
#include <assert.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <list>
#include <map>
#include <queue>
#include <set>
#include <string>
#include <vector>

#include "control/batch_controller.hh"
#include "geometry/geometry.hh"
#include "insight/explain.hh"
#include "messages/assert.hh"
#include "messages/log.hh"
#include "models/actuator.hh"
#include "models/ancestor.hh"
#include "models/blinkenlight.hh"
#include "models/blobfinder.hh"
#include "models/bumper.hh"
#include "models/camera.hh"
#include "models/camera_view.hh"
#include "models/fiducial.hh"
#include "models/field.hh"
#include "models/flag.hh"
#include "models/gripper.hh"
#include "models/groundsensor.hh"
#include "models/light.hh"
#include "models/lightindicator.hh"
#include "models/lightsensor.hh"
#include "models/log_entry.hh"
#include "models/messages.hh"
#include "models/model.hh"
#include "models/model_type.hh"
#include "models/position.hh"
#include "models/power_pack.hh"
#include "models/radio.hh"
#include "models/range_response.hh"
#include "models/ranger.hh"
#include "models/readings.hh"
#include "models/state_exchange.hh"
#include "models/visualizer.hh"
#include "models/wifi.hh"
#include "motion/contact_model.hh"
#include "pictures/color.hh"
#include "pictures/image_polygons.hh"
#include "random/random.hh"
#include "whatif/belief.hh"
#include "whatif/branches.hh"
#include "whatif/consequence_engine.hh"
#include "world/controllers.hh"
#include "world/plugin_stamp.hh"
#include "world/ray_caster.hh"
#include "world/snapshot.hh"
#include "world/statistics.hh"
#include "world/world.hh"
#include "worldfile/worldfile.hh"
#include "worlds/world_pool.hh"

namespace Stg {

/// Initializes the library; call it before creating a World. Keeps the arguments in World::args and
/// registers the model types. Does not change the arguments or the process's locale, and may be
/// called again. A World that is created earlier warns and calls it without arguments.
void Init(int* argc, char** argv[]);
bool InitDone();
/// The version as text, such as "5.0.0".
const char* Version();
/// The version as a number: major * 10000 + minor * 100 + patch.
unsigned int FullVersion();
/// Fills Model::name_map with all registered model types, built-in ones included. Init() calls it.
void RegisterModels();

/// Facts about the program.
extern const char COPYRIGHT[], AUTHORS[], WEBSITE[], DESCRIPTION[], LICENSE[];

/// The value of fiducial_return for models that are not fiducials.
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

// Includes the window's header if the window is built and FLTK's headers are found. Define
// STAGE_WITHOUT_WINDOW to compile faster without it.
#if !defined(STAGE_WITHOUT_WINDOW) && __has_include("window/world_gui.hh") && \
                                                    __has_include(<FL/Fl_Gl_Window.H>)
#include "window/world_gui.hh"
#endif

#endif
