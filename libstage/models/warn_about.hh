// SPDX-License-Identifier: GPL-2.0-or-later
#ifndef STAGE_MODELS_WARN_ABOUT_HH
#define STAGE_MODELS_WARN_ABOUT_HH

namespace Stg {

class Ancestor;

/// Reports "stage: warning: NAME: TEXT", where NAME is the name of the model or world. The format
/// is that of printf(). Apply messages::Quoted() to names among the arguments.
[[gnu::format(printf, 2, 3)]] void WarnAbout(const Ancestor& who, const char* format, ...);

}  // namespace Stg

#endif
