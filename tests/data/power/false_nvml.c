// SPDX-License-Identifier: GPL-2.0-or-later
//
// Replaces NVIDIA's management library: two GPUs, with energy counters unless WITHOUT_COUNTER is
// defined.

#include <stdio.h>

static int initialised;
static unsigned long long millijoules = 6000000000ULL;
static int gpus[2];

enum { kSuccess, kUninitialised, kInvalidArgument };

int nvmlInit_v2(void) {
  ++initialised;
  return kSuccess;
}

int nvmlShutdown(void) {
  if (initialised == 0) return kUninitialised;
  --initialised;
  return kSuccess;
}

int nvmlDeviceGetCount_v2(unsigned int* count) {
  if (initialised == 0) return kUninitialised;
  *count = 2;
  return kSuccess;
}

int nvmlDeviceGetHandleByIndex_v2(unsigned int index, void** handle) {
  if (initialised == 0) return kUninitialised;
  if (index >= 2) return kInvalidArgument;
  *handle = &gpus[index];
  return kSuccess;
}

// The index of a handle, or -1.
static int Index(void* handle) {
  if (initialised == 0) return -1;
  return handle == &gpus[0] ? 0 : handle == &gpus[1] ? 1 : -1;
}

int nvmlDeviceGetName(void* handle, char* name, unsigned int length) {
  if (Index(handle) < 0) return kInvalidArgument;
  snprintf(name, length, "False GPU %d", Index(handle));
  return kSuccess;
}

#ifndef WITHOUT_COUNTER
int nvmlDeviceGetTotalEnergyConsumption(void* handle, unsigned long long* energy) {
  if (Index(handle) < 0) return kInvalidArgument;
  millijoules += Index(handle) == 1 ? 50000 : 0;
  *energy = millijoules;
  return kSuccess;
}
#endif

int nvmlDeviceGetPowerUsage(void* handle, unsigned int* milliwatts) {
  if (Index(handle) < 0) return kInvalidArgument;
  *milliwatts = Index(handle) == 1 ? 71500 : 10000;
  return kSuccess;
}
