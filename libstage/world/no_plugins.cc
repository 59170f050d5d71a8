// SPDX-License-Identifier: GPL-2.0-or-later
//
// Replaces plugin.cc, plugin_file.cc, gui_loader.cc and prefilter_loader.cc in static builds, which
// load nothing at run time.

#include "messages/report.hh"
#include "sensing/prefilter.hh"
#include "world/gui_loader.hh"
#include "world/linked_controllers.hh"
#include "world/plugin.hh"
#include "world/prefilter_loader.hh"

namespace Stg {

namespace {
// Whole sentences, because GCC 12 warns wrongly about concatenations of long constants.
constexpr char kNoPlugins[] =
    "this program was built with STAGE_STATIC and loads no plug-ins; link the plug-in's model "
    "types "
    "into it and remove this property, or build Stage without STAGE_STATIC";
constexpr char kNoWindow[] = "this program was built with STAGE_STATIC, without the window";
constexpr char kNoOpenCl[] = "this program was built with STAGE_STATIC, without OpenCL";
}  // namespace

void* OpenPlugin(const std::string&, std::string* error, Stamp) {
  *error = kNoPlugins;
  return nullptr;
}

void* FindSymbol(void*, const char*, std::string*) { return nullptr; }

ControllerCode FindPluginController(const std::string&, std::string* error) {
  std::string linked;
  for (const std::string& name : LinkedControllerNames())
    linked += (linked.empty() ? "" : ", ") + name;
  *error = "is not linked into this program; expected one of " +
           (linked.empty() ? "none" : linked) + "; see RegisterController()";
  return {};
}

void* FindInGui(const char*, std::string* message) {
  *message = kNoWindow;
  return nullptr;
}

std::unique_ptr<sensing::Prefilter> LoadPrefilter(const std::string&, const std::string&,
                                                  std::string* message) {
  *message = kNoOpenCl;
  return nullptr;
}

std::string ListDevices(const std::string&) { return std::string(kNoOpenCl) + '\n'; }

}  // namespace Stg
