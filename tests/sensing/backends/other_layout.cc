// SPDX-License-Identifier: GPL-2.0-or-later
//
// A backend that was built with other headers or another compiler. Calling it fails the test.

#include <cstdlib>

#include "sensing/backend.hh"

using namespace Stg::internal::sensing;

extern "C" {
extern const Backend stage_backend;
const Backend stage_backend = {kBackendVersion, sizeof(Backend), BackendLayout() ^ 1,
                               [](const char*, TextSink, void*) -> Prefilter* { std::abort(); },
                               [](TextSink, void*) { std::abort(); }};
}
