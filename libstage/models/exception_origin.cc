// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/exception_origin.hh"

#include <cstdio>
#include <cstring>
#include <exception>
#include <new>

#include "files/library_folder.hh"
#include "messages/report.hh"

namespace Stg {

namespace {
thread_local char thrower[400];

/// Replaces control characters, because names come from files.
void Clean(char* text) {
  for (; *text; text++)
    if (static_cast<unsigned char>(*text) < 0x20 || *text == 0x7f) *text = '?';
}
}  // namespace

std::string DescribeException() {
  try {
    throw;
  } catch (const std::exception& error) {
    return std::string("an exception: ") + error.what();
  } catch (const char* text) {
    return std::string("the text \"") + text + "\"";
  } catch (int number) {
    return "the number " + std::to_string(number);
  } catch (...) {
    return "an exception of unknown type";
  }
}

std::string DescribeThrown() {
  return std::string(*ExceptionOrigin() ? ExceptionOrigin() : "something") + " has thrown " +
         messages::Shortened(DescribeException(), messages::kMaxDetailBytes);
}

const char* ExceptionOrigin() noexcept { return thrower; }
void SetExceptionOrigin(const char* text) noexcept {
  std::snprintf(thrower, sizeof thrower, "%s", text);
}
void ClearExceptionOrigin() noexcept { thrower[0] = '\0'; }

void RecordExceptionOrigin(const char* what, const Model* model, void (*function)()) noexcept {
  if (thrower[0]) return;
  size_t length = static_cast<size_t>(std::snprintf(thrower, sizeof thrower, "%s", what));
  const auto add = [&](const char* format, const char* text) {
    if (length < sizeof thrower)
      length += static_cast<size_t>(
          std::snprintf(thrower + length, sizeof thrower - length, format, text));
  };
  if (model) add(" of model \"%.150s\"", model->Token());
  if (const char* const file = files::FileOfCode(reinterpret_cast<void*>(function))) {
    const char* slash = std::strrchr(file, '/');
    add(" in %.150s", slash ? slash + 1 : file);
  }
  Clean(thrower);
}

void RecordUpdateException(const Model* model) noexcept {
  try {
    throw;
  } catch (const std::bad_alloc&) {
    return;
  } catch (...) {
    RecordExceptionOrigin("the update", model, nullptr);
  }
}

}  // namespace Stg
