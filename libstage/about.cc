// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage.hh"

namespace Stg {

const char COPYRIGHT[] = "Copyright the authors of Stage 5";
const char AUTHORS[] = "The authors of Stage 5, after the ideas and the interface of Stage";
const char WEBSITE[] = "see README.md";
const char DESCRIPTION[] = "Stage 5, a simulator for crowds of mobile robots in the plane";
const char LICENSE[] =
    "GNU General Public License, version 2 or, at your option, any later version";

}  // namespace Stg
