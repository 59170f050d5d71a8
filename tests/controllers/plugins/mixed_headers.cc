// SPDX-License-Identifier: GPL-2.0-or-later
//
// A plug-in with one file that was compiled with other headers than the rest: it carries two
// stamps.

#include "stage.hh"
#include "tests/controllers/plugins/other_stamp.hh"

extern "C" int Init(Stg::Model*, Stg::CtrlArgs*) { return 0; }
