// SPDX-License-Identifier: GPL-2.0-or-later

#include "libstage_cl/device.hh"

#include <strings.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <system_error>

#include "libstage_cl/environment.hh"
#include "libstage_cl/pocl_cache.hh"

namespace Stg::cl {

namespace {

// Error code of an OpenCL loader without any driver.
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
  if (IsEmbedded(device)) found.version += ", embedded profile";
  found.compute_units = device.getInfo<CL_DEVICE_MAX_COMPUTE_UNITS>();
  found.megabytes = static_cast<unsigned>(device.getInfo<CL_DEVICE_GLOBAL_MEM_SIZE>() >> 20);
  return found;
}

/// Path of a registered driver's .icd file, or empty. Searches like the usual loaders.
std::string RegisteredDriver() {
  std::string folder = FromEnvironment("OCL_ICD_VENDORS");
  if (folder.empty()) folder = FromEnvironment("OPENCL_VENDOR_PATH");
  if (folder.empty()) folder = "/etc/OpenCL/vendors";
  if (folder.ends_with(".icd")) return folder;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(folder, ignored))
    if (entry.path().extension() == ".icd") return entry.path();
  return "";
}

/// Advice if Mesa's driver offers no device: it must be told which ones it may use.
std::string WhyRusticlIsEmpty(const std::string& driver) {
  if (driver.find("rusticl") == std::string::npos || !FromEnvironment("RUSTICL_ENABLE").empty())
    return "";
  return "; it needs RUSTICL_ENABLE in the environment, such as RUSTICL_ENABLE=panfrost, v3d or "
         "llvmpipe";
}

/// Advice if no driver works.
std::string Advice() {
  if (const std::string driver = RegisteredDriver(); !driver.empty())
    return "the OpenCL driver that " + driver +
           " names can't be used: its library is missing or broken, or finds no device" +
           WhyRusticlIsEmpty(driver);
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

void CollectDevices(Search* search) {
  std::string platforms, advice;
  for (const ::cl::Platform& platform : Platforms()) {
    calls::SetDriver("");
    const std::string name = Text(platform.getInfo<CL_PLATFORM_NAME>());
    calls::SetDriver(name);
    platforms += (platforms.empty() ? "" : ", ") + name;
    for (const ::cl::Device& device : DevicesOf(platform))
      search->found.push_back(Examine(platform, device));
    if (search->found.empty()) advice += WhyPoclCantWrite(name) + WhyRusticlIsEmpty(name);
  }
  if (!search->found.empty()) return;
  search->reason =
      platforms.empty() ? Advice() : "the driver " + platforms + " offers no device" + advice;
}

Search SearchDevices() {
  Search search;
  try {
    CollectDevices(&search);
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
  // Never deleted, because drivers may end before this library does.
  static const Search* const search = new Search(SearchDevices());
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
    const auto is = [&](const std::string& text) {
      return strcasecmp(text.c_str(), name.c_str()) == 0;
    };
    const bool by_kind = is("gpu") || is("cpu") || is("accelerator");
    if (name.empty() || is("auto") ||
        (by_kind ? is(device.kind) : contains(device.name) || contains(device.platform)))
      matching.push_back(device);
  }
  if (index == std::string::npos) return matching;
  if (index >= matching.size()) return {};
  return {matching[index]};
}

bool IsEmbedded(const ::cl::Device& device) {
  return Text(device.getInfo<CL_DEVICE_PROFILE>()) == "EMBEDDED_PROFILE";
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
