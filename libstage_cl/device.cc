// SPDX-License-Identifier: GPL-2.0-or-later

#include "libstage_cl/device.hh"

#include <signal.h>
#include <strings.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <fstream>

namespace Stg::cl {

namespace {

constexpr int kProbeSeconds = 30;

// How the process that asks first ends, unless a driver ends it: numbers that no driver will use.
constexpr int kProbeDone = 90, kProbeRefused = 91;

// What an OpenCL loader answers where there is no driver at all.
constexpr cl_int kPlatformNotFound = -1001;

const char* KindOf(cl_device_type type) {
  if (type & CL_DEVICE_TYPE_GPU) return "gpu";
  return type & CL_DEVICE_TYPE_CPU ? "cpu" : "accelerator";
}

int RankOf(const std::string& kind) { return kind == "gpu" ? 0 : kind == "cpu" ? 2 : 1; }

std::vector<::cl::Platform> Platforms() {
  std::vector<::cl::Platform> platforms;
  try {
    ::cl::Platform::get(&platforms);
  } catch (const ::cl::Error& error) {
    if (error.err() != kPlatformNotFound) throw;
  }
  return platforms;
}

std::vector<::cl::Device> DevicesOf(const ::cl::Platform& platform) {
  std::vector<::cl::Device> devices;
  try {
    platform.getDevices(CL_DEVICE_TYPE_ALL, &devices);
  } catch (const ::cl::Error& error) {
    if (error.err() != CL_DEVICE_NOT_FOUND) throw;
  }
  return devices;
}

std::string Text(std::string text) {
  text.erase(std::find(text.begin(), text.end(), '\0'), text.end());
  return text;
}

FoundDevice Examine(const ::cl::Platform& platform, const ::cl::Device& device) {
  FoundDevice found;
  found.device = device;
  found.kind = KindOf(device.getInfo<CL_DEVICE_TYPE>());
  found.name = Text(device.getInfo<CL_DEVICE_NAME>());
  found.platform = Text(platform.getInfo<CL_PLATFORM_NAME>());
  found.version = Text(device.getInfo<CL_DEVICE_VERSION>());
  found.compute_units = device.getInfo<CL_DEVICE_MAX_COMPUTE_UNITS>();
  found.megabytes = static_cast<unsigned>(device.getInfo<CL_DEVICE_GLOBAL_MEM_SIZE>() >> 20);
  return found;
}

std::vector<FoundDevice> Enumerate() {
  std::vector<FoundDevice> found;
  for (const ::cl::Platform& platform : Platforms())
    for (const ::cl::Device& device : DevicesOf(platform))
      found.push_back(Examine(platform, device));
  return found;
}

/// Waits for a child process, but not for ever. False if it had to be killed.
bool WaitFor(pid_t child, int* status) {
  for (int i = 0; i < kProbeSeconds * 100; i++) {
    const pid_t ended = waitpid(child, status, WNOHANG);
    if (ended != 0) return ended == child;
    usleep(10000);
  }
  kill(child, SIGKILL);
  waitpid(child, status, 0);
  return false;
}

/// Some drivers abort the process that asks for them (two with different LLVMs in them, for
/// instance, or one in a container without /sys). So a child asks first.
bool ProbeSurvives(std::string* reason) {
  const pid_t child = fork();
  if (child < 0) return true;  // no process to spare: take the risk
  if (child == 0) {
    signal(SIGABRT, SIG_DFL);
    int status = kProbeDone;
    try {
      Enumerate();
    } catch (const ::cl::Error&) {
      status = kProbeRefused;  // the parent will get the same error, and report it
    }
    _exit(status);
  }
  int status = 0;
  if (!WaitFor(child, &status)) {
    *reason = "an OpenCL driver hangs when it is asked for its devices";
    return false;
  }
  if (WIFSIGNALED(status)) {
    *reason = std::string("an OpenCL driver crashes when it is asked for its devices (") +
              strsignal(WTERMSIG(status)) + ")";
    return false;
  }
  const int ended = WEXITSTATUS(status);
  if (ended == kProbeDone || ended == kProbeRefused) return true;
  *reason = "an OpenCL driver ends the process when it is asked for its devices (status " +
            std::to_string(ended) + ")";
  return false;
}

/// What to do if no device is found.
std::string Advice() {
  for (const char* path :
       {"/usr/lib/x86_64-linux-gnu/libnvidia-opencl.so.1",
        "/usr/lib/aarch64-linux-gnu/libnvidia-opencl.so.1", "/usr/lib64/libnvidia-opencl.so.1",
        "/usr/lib/libnvidia-opencl.so.1", "/usr/local/nvidia/lib64/libnvidia-opencl.so.1"}) {
    if (std::ifstream(path))
      return std::string("no OpenCL driver is registered, but NVIDIA's is there: write \"") + path +
             "\" into /etc/OpenCL/vendors/nvidia.icd";
  }
  return "no OpenCL driver is installed; \"apt install pocl-opencl-icd\" gives one for this "
         "processor";
}

struct Search {
  std::vector<FoundDevice> found;
  std::string reason;  // why there are none
};

Search LookForDevices() {
  Search search;
  if (!ProbeSurvives(&search.reason)) return search;
  try {
    search.found = Enumerate();
    if (search.found.empty()) search.reason = Advice();
    std::stable_sort(search.found.begin(), search.found.end(),
                     [](const FoundDevice& a, const FoundDevice& b) {
                       if (a.kind != b.kind) return RankOf(a.kind) < RankOf(b.kind);
                       return a.compute_units > b.compute_units;
                     });
  } catch (const ::cl::Error& error) {
    search.found.clear();
    search.reason = std::string(error.what()) + " failed with error " + std::to_string(error.err());
  }
  return search;
}

}  // namespace

const std::vector<FoundDevice>& FindDevices(std::string* reason) {
  // Never deleted: when the process ends, drivers may end before us.
  static const Search* const search = new Search(LookForDevices());
  *reason = search->reason;
  return search->found;
}

std::vector<FoundDevice> MatchingDevices(const std::vector<FoundDevice>& devices,
                                         const std::string& choice) {
  std::string name = choice;
  size_t index = std::string::npos;
  const size_t colon = choice.rfind(':');
  if (colon != std::string::npos && colon + 1 < choice.size() && choice.size() - colon < 8 &&
      choice.find_first_not_of("0123456789", colon + 1) == std::string::npos) {
    name = choice.substr(0, colon);
    index = std::stoul(choice.substr(colon + 1));
  }
  std::vector<FoundDevice> matching;
  for (const FoundDevice& device : devices) {
    const auto contains = [&](const std::string& text) {
      return strcasestr(text.c_str(), name.c_str()) != nullptr;
    };
    const bool by_kind =
        strcasecmp(name.c_str(), "gpu") == 0 || strcasecmp(name.c_str(), "cpu") == 0;
    const bool any = name.empty() || strcasecmp(name.c_str(), "auto") == 0;
    if (any || (by_kind ? strcasecmp(name.c_str(), device.kind.c_str()) == 0
                        : contains(device.name) || contains(device.platform)))
      matching.push_back(device);
  }
  if (index == std::string::npos) return matching;
  if (index >= matching.size()) return {};
  return {matching[index]};
}

std::string Describe(const FoundDevice& d) {
  return d.kind + ": " + d.name + " (" + d.platform + ", " + d.version + ", " +
         std::to_string(d.compute_units) + " compute units, " + std::to_string(d.megabytes) +
         " MiB)";
}

std::string DescribeAll(const std::vector<FoundDevice>& devices) {
  std::string text;
  for (const FoundDevice& device : devices) text += "  " + Describe(device) + "\n";
  return text;
}

}  // namespace Stg::cl
