// SPDX-License-Identifier: GPL-2.0-or-later
//
// Typed readers and writers of Worldfile.
#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <new>
#include <string>
#include <string_view>
#include <vector>

#include "worldfile/find_file.hh"
#include "worldfile/numbers.hh"
#include "worldfile/worldfile_impl.hh"

namespace Stg {
namespace {

constexpr long long kIntMin = std::numeric_limits<int>::min();
constexpr long long kIntMax = std::numeric_limits<int>::max();
constexpr long long kUnsignedMax = std::numeric_limits<unsigned int>::max();

// Copies to a new C string that the caller must free(), as in Stage 4.3.
char* NewString(const std::string& text) {
  char* copy = strdup(text.c_str());
  if (copy == nullptr) throw std::bad_alloc();
  return copy;
}

// An element of a tuple that has been read but not yet stored.
struct Element {
  double number = 0;
  long long integer = 0;
  std::string text;
};

// Wraps a va_list, which cannot be passed by reference on every platform.
struct Arguments {
  std::va_list list;
};

void HandOut(Arguments& args, char kind, const Element& element) {
  switch (kind) {
    case 'i':
      *va_arg(args.list, int*) = static_cast<int>(element.integer);
      break;
    case 'u':
      *va_arg(args.list, unsigned int*) = static_cast<unsigned int>(element.integer);
      break;
    case 's':
      *va_arg(args.list, char**) = NewString(element.text);
      break;
    default:
      *va_arg(args.list, double*) = element.number;
      break;
  }
}

// Replaces characters that strings in world files cannot contain, because there are no escapes.
std::string StringText(std::string text) {
  for (char& c : text) {
    if (c == '"') c = '\'';
    if (c == '\n' || c == '\r' || c == '\0') c = ' ';
  }
  return text;
}

bool IsFormat(char kind) { return kind != '\0' && std::strchr("iuflas", kind) != nullptr; }

}  // namespace

// ---- conversions ----

void Worldfile::FailAt(int property, std::size_t index, const std::string& message) const {
  const worldfile::Document& document = impl_->document;
  const worldfile::Property& from = document.properties[static_cast<std::size_t>(property)];
  document.Fail(document.tokens[from.first_value + index],
                "property " + worldfile::Quoted(document.names.Text(from.name)) + ": " + message);
}

void Worldfile::WarnAt(int property, std::size_t index, const std::string& message) {
  worldfile::Document& document = impl_->document;
  const worldfile::Property& from = document.properties[static_cast<std::size_t>(property)];
  document.Warn(document.tokens[from.first_value + index],
                "property " + worldfile::Quoted(document.names.Text(from.name)) + ": " + message);
}

double Worldfile::ReadNumber(int entity, int property, std::size_t index) {
  const std::string_view text = impl_->Value(entity, property, index);
  const worldfile::ReadNumber number = worldfile::ReadFloatText(text);
  if (!std::isfinite(number.value)) {
    FailAt(property, index, "found " + worldfile::Quoted(text) + ", expected a finite number");
  }
  if (!number.clean) {
    WarnAt(property, index,
           "found " + worldfile::Quoted(text) + ", expected a number; read as " +
               worldfile::FloatText(number.value));
  }
  return number.value;
}

long long Worldfile::ReadInteger(int entity, int property, std::size_t index, long long low,
                                 long long high) {
  const std::string_view text = impl_->Value(entity, property, index);
  const worldfile::ReadInteger number = worldfile::ReadIntText(text);
  // Values such as "nan" and "1e999" are refused, not read as 0 and 1.
  if (!number.clean && !std::isfinite(worldfile::ReadFloatText(text).value)) {
    FailAt(property, index, "found " + worldfile::Quoted(text) + ", expected a finite number");
  }
  const long long value = std::min(std::max(number.value, low), high);
  if (!number.clean || value != number.value) {
    WarnAt(property, index,
           "found " + worldfile::Quoted(text) + ", expected a whole number from " +
               std::to_string(low) + " to " + std::to_string(high) + "; read as " +
               std::to_string(value));
  }
  return value;
}

// ---- scalars ----

// Fetch() for readers of a single value: treats an empty tuple as absent.
int Worldfile::FetchScalar(int entity, const char* name) {
  const int property = Fetch(entity, name);
  if (property < 0) return -1;
  if (impl_->document.properties[static_cast<std::size_t>(property)].value_count > 0) {
    NoteRead(property, 1);
    return property;
  }
  WarnAt(property, 0, "found an empty tuple, expected a value; using the default");
  return -1;
}

const std::string Worldfile::ReadString(int entity, const char* name, const std::string& value) {
  const int property = FetchScalar(entity, name);
  return property < 0 ? value : std::string(impl_->Value(entity, property, 0));
}

int Worldfile::ReadInt(int entity, const char* name, int value) {
  const int property = FetchScalar(entity, name);
  if (property < 0) return value;
  return static_cast<int>(ReadInteger(entity, property, 0, kIntMin, kIntMax));
}

double Worldfile::ReadFloat(int entity, const char* name, double value) {
  const int property = FetchScalar(entity, name);
  return property < 0 ? value : ReadNumber(entity, property, 0);
}

double Worldfile::ReadLength(int entity, const char* name, double value) {
  const int property = FetchScalar(entity, name);
  return property < 0 ? value : ReadNumber(entity, property, 0) * unit_length;
}

double Worldfile::ReadAngle(int entity, const char* name, double value) {
  const int property = FetchScalar(entity, name);
  return property < 0 ? value : ReadNumber(entity, property, 0) * unit_angle;
}

const char* Worldfile::ReadFilename(int entity, const char* name, const char* value) {
  const int property = FetchScalar(entity, name);
  if (property < 0) return value;
  const std::string path(impl_->Value(entity, property, 0));
  return impl_->kept_strings
      .emplace(path.empty() ? path : worldfile::CompletePath(impl_->base_directory, path))
      .first->c_str();
}

// ---- tuples ----

std::string Worldfile::ReadElement(int entity, const char* name, std::size_t index) {
  const int property = Fetch(entity, name);
  if (property < 0) return "";
  if (index >= impl_->document.properties[static_cast<std::size_t>(property)].value_count)
    return "";
  NoteRead(property, index + 1);
  return std::string(impl_->Value(entity, property, index));
}

int Worldfile::ReadTuple(const int entity, const char* name, const unsigned int first,
                         const unsigned int count, const char* format, ...) {
  const int property = Fetch(entity, name);
  if (property < 0) return 0;
  const std::size_t length =
      impl_->document.properties[static_cast<std::size_t>(property)].value_count;
  const std::size_t end = static_cast<std::size_t>(first) + count;
  NoteRead(property, end);
  if (length < end) {
    FailAt(property, 0,
           "found a tuple of length " + std::to_string(length) + ", expected at least " +
               std::to_string(end) + " values");
  }
  // Reads all elements before storing any, so that an error changes nothing.
  std::vector<Element> elements;
  for (std::size_t i = 0; i < count && IsFormat(format[i]); ++i) {
    elements.push_back({});
    Element& element = elements.back();
    if (format[i] == 's') {
      element.text = impl_->Value(entity, property, first + i);
    } else if (format[i] == 'i') {
      element.integer = ReadInteger(entity, property, first + i, kIntMin, kIntMax);
    } else if (format[i] == 'u') {
      element.integer = ReadInteger(entity, property, first + i, 0, kUnsignedMax);
    } else {
      const double unit = format[i] == 'l' ? unit_length : format[i] == 'a' ? unit_angle : 1.0;
      element.number = ReadNumber(entity, property, first + i) * unit;
    }
  }
  Arguments args;
  va_start(args.list, format);
  for (std::size_t i = 0; i < elements.size(); ++i) HandOut(args, format[i], elements[i]);
  va_end(args.list);
  return static_cast<int>(count);
}

void Worldfile::WriteTuple(const int entity, const char* name, const unsigned int first,
                           const unsigned int count, const char* format, ...) {
  std::va_list args;
  va_start(args, format);
  for (std::size_t i = 0; i < count && IsFormat(format[i]); ++i) {
    const std::size_t at = first + i;
    switch (format[i]) {
      case 'i':
        WriteValue(entity, name, at, std::to_string(va_arg(args, int)));
        break;
      case 'u':
        WriteValue(entity, name, at, std::to_string(va_arg(args, unsigned int)));
        break;
      case 's':
        WriteValue(entity, name, at, StringText(va_arg(args, const char*)));
        break;
      default: {
        const double unit = format[i] == 'l' ? unit_length : format[i] == 'a' ? unit_angle : 1.0;
        const double value = va_arg(args, double);
        WriteValue(entity, name, at, worldfile::TextInUnit(value, unit),
                   std::isfinite(value / unit));
      }
    }
  }
  va_end(args);
}

// ---- writing ----

// Records a new value. Non-finite values (`valid` is false), which could not be read back, are
// refused.
void Worldfile::WriteValue(int entity, const char* name, std::size_t index, const std::string& text,
                           bool valid) {
  if (entity >= impl_->written_count) return;  // it is not in the text that is saved
  const int number = Find(entity, name);
  if (number < 0) return;
  const worldfile::Property& property =
      impl_->document.properties[static_cast<std::size_t>(number)];
  if (index >= property.value_count) return;
  if (!valid) {
    WarnAt(number, index, "found a value that is not finite to save, expected a finite one");
    return;
  }
  worldfile::Written& written = impl_->written[{static_cast<std::uint32_t>(entity), property.name}];
  written.resize(property.value_count);
  written[index] = text;
}

void Worldfile::WriteString(int entity, const char* name, const std::string& value) {
  WriteValue(entity, name, 0, StringText(value));
}

void Worldfile::WriteInt(int entity, const char* name, int value) {
  WriteValue(entity, name, 0, std::to_string(value));
}

void Worldfile::WriteFloat(int entity, const char* name, double value) {
  WriteValue(entity, name, 0, worldfile::FloatText(value), std::isfinite(value));
}

void Worldfile::WriteLength(int entity, const char* name, double value) {
  WriteValue(entity, name, 0, worldfile::TextInUnit(value, unit_length),
             std::isfinite(value / unit_length));
}

}  // namespace Stg
