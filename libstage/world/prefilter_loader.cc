// SPDX-License-Identifier: GPL-2.0-or-later

#include "world/prefilter_loader.hh"

#include <cstddef>
#include <cstdio>

#include "files/library_folder.hh"
#include "sensing/backend.hh"
#include "world/plugin.hh"

namespace Stg {

namespace {

using sensing::Backend;

std::string Hexadecimal(uint64_t number) {
  char text[20];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(number));
  return text;
}

/// Returns why a backend cannot be used, or "" if it can. Checks the version first: the layout of
/// the other fields depends on it.
std::string FaultOf(const Backend& backend) {
  const char* const known = files::FileOfCode(&backend);
  const std::string file = known ? known : "the plug-in";
  if (backend.version != sensing::kBackendVersion)
    return file + ": found version " + std::to_string(backend.version) +
           " of stage_backend, expected version " + std::to_string(sensing::kBackendVersion);
  if (backend.size != sizeof(Backend) || backend.layout != sensing::BackendLayout())
    return file + ": found a plug-in of another build (version " + std::to_string(backend.version) +
           ", layout " + Hexadecimal(backend.layout) + "), expected layout " +
           Hexadecimal(sensing::BackendLayout());
  return "";
}

/// Opens the backend of a plug-in. Returns null and the reason in *message on failure.
const Backend* OpenBackend(const std::string& name, std::string* message) {
  std::string error;
  void* const plugin = OpenPlugin(name, &error, Stamp::kNone);
  const void* const symbol = plugin ? FindSymbol(plugin, "stage_backend", &error) : nullptr;
  if (plugin && !symbol)
    error += "; expected version " + std::to_string(sensing::kBackendVersion) + " of it";
  const auto* const backend = static_cast<const Backend*>(symbol);
  if (backend) error = FaultOf(*backend);
  if (error.empty()) return backend;
  *message = "the plug-in " + name + " can't be loaded: " + error;
  if (!plugin && name == kOpenClPlugin) {
    *message +=
        "; it is built where OpenCL's headers and loader are installed (tools/run WORLD --opencl "
        "does that), "
        "and comes in the Debian package stage-opencl";
  }
  return nullptr;
}

void KeepText(void* to, const char* text) { *static_cast<std::string*>(to) = text; }

}  // namespace

std::unique_ptr<sensing::Prefilter> LoadPrefilter(const std::string& plugin,
                                                  const std::string& choice, std::string* message) {
  const Backend* const backend = OpenBackend(plugin, message);
  if (!backend) return nullptr;
  return std::unique_ptr<sensing::Prefilter>(backend->make(choice.c_str(), KeepText, message));
}

std::string ListDevices(const std::string& plugin) {
  std::string text;
  const Backend* const backend = OpenBackend(plugin, &text);
  if (!backend) return text + "\n";
  backend->list(KeepText, &text);
  return text.ends_with('\n') ? text : text + "\n";
}

}  // namespace Stg
