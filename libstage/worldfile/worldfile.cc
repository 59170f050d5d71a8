// SPDX-License-Identifier: GPL-2.0-or-later
#include "worldfile/worldfile.hh"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <istream>
#include <system_error>
#include <utility>

#include "geometry/load_error.hh"
#include "messages/report.hh"
#include "worldfile/find_file.hh"
#include "worldfile/lexer.hh"
#include "worldfile/old_names.hh"
#include "worldfile/parser.hh"
#include "worldfile/settings.hh"
#include "worldfile/unused_families.hh"
#include "worldfile/worldfile_impl.hh"

namespace Stg {
namespace {

using worldfile::kNone;

constexpr double kRadiansPerDegree = 3.14159265358979323846 / 180.0;

std::string ReadStream(std::istream& in, const std::string& name) {
  std::string text;
  std::vector<char> buffer(1U << 16);
  while (in.read(buffer.data(), static_cast<std::streamsize>(buffer.size())), in.gcount() > 0) {
    text.append(buffer.data(), static_cast<std::size_t>(in.gcount()));
    if (text.size() > worldfile::kMaxTextBytes) {
      throw LoadError(name + ": found more than " + std::to_string(worldfile::kMaxTextBytes >> 20) +
                      " MiB of text, expected a world file");
    }
  }
  text.shrink_to_fit();
  return text;
}

std::string KeyOf(const std::string& file) {
  std::error_code error;
  const std::filesystem::path path = std::filesystem::canonical(file, error);
  return error ? file : path.string();
}

}  // namespace

// ---- loading ----

Worldfile::Worldfile() : unit_length(1.0), unit_angle(kRadiansPerDegree), impl_(new Impl) {
  Reset();
}

Worldfile::~Worldfile() = default;

void Worldfile::Reset() {
  impl_.reset(new Impl);
  unit_length = 1.0;
  unit_angle = kRadiansPerDegree;
}

bool Worldfile::Load(const std::string& file) {
  Reset();
  filename = file;
  std::string reason;
  const std::string path = worldfile::FindFile("", file, &reason);
  if (path.empty()) {
    throw LoadError(worldfile::Shortened(file, messages::kMaxDetailBytes) +
                    ": unable to open world file: " + reason +
                    worldfile::AdviceForMissing("", file, ".world"));
  }
  filename = path;
  impl_->base_directory = worldfile::DirectoryOf(path);
  impl_->document.sources.Add(path, KeyOf(path), worldfile::ReadWholeFile(path));
  Parse();
  WarnIfEmpty();
  return true;
}

bool Worldfile::Load(std::istream& world_content, const std::string& file) {
  Reset();
  filename = file;
  impl_->base_directory = worldfile::DirectoryOf(file);
  const std::string name = file.empty() ? "<stream>" : file;
  impl_->document.sources.Add(name, file.empty() ? "" : KeyOf(file),
                              ReadStream(world_content, name));
  Parse();
  return true;
}

std::vector<Worldfile::Text> Worldfile::Texts() const {
  const worldfile::SourceSet& sources = impl_->document.sources;
  std::vector<Text> texts;
  for (std::uint32_t i = 0; i < impl_->files; ++i)
    texts.push_back({sources.Name(i), std::string(sources.Text(i))});
  return texts;
}

void Worldfile::Parse() {
  try {
    worldfile::Lexer(impl_->document, impl_->base_directory).Run();
    impl_->files = static_cast<std::uint32_t>(impl_->document.sources.Count());
    worldfile::Parser parser(impl_->document);
    parser.ParseFile();
    ApplySettings();
    ReadUnits();
    AddPopulations(&parser.expander());
    impl_->written_count = GetEntityCount();
  } catch (const LoadError& error) {
    const std::string kind = worldfile::KindOfForeignFile(impl_->document.sources.Text(0));
    const std::string message = error.what();
    Reset();
    if (kind.empty()) throw;
    throw LoadError(message + "; this looks like " + kind, error.exit_status());
  }
}

// Only for files: programs use an empty stream for a world without models.
void Worldfile::WarnIfEmpty() {
  const worldfile::Document& document = impl_->document;
  if (document.entities.size() > 1 || document.bodies[0].property_count > 0) return;
  const bool defines = !document.macros.empty();
  Warn(0, "",
       defines ? "found definitions alone, expected sections that use them; the world is empty"
               : "found an empty file, expected properties and sections; the world is empty");
}

void Worldfile::ReadUnits() {
  const std::string length = ReadString(0, "unit_length", "m");
  if (length == "cm") {
    unit_length = 0.01;
  } else if (length == "mm") {
    unit_length = 0.001;
  } else if (length != "m") {
    Warn(0, "unit_length",
         "found " + worldfile::Quoted(length) + ", expected \"m\", \"cm\" or \"mm\"; using \"m\"");
  }
  const std::string angle = ReadString(0, "unit_angle", "degrees");
  if (angle == "radians") {
    unit_angle = 1.0;
  } else if (angle != "degrees") {
    Warn(0, "unit_angle",
         "found " + worldfile::Quoted(angle) +
             ", expected \"degrees\" or \"radians\"; using \"degrees\"");
  }
}

void Worldfile::Set(const std::vector<std::string>& settings) { settings_ = settings; }

void Worldfile::CheckSettings() const { worldfile::CheckOverridesAreRead(impl_->document); }

void Worldfile::ForgetWritten() { impl_->written.clear(); }

std::unique_ptr<Worldfile> Worldfile::Copy() const {
  auto copy = std::make_unique<Worldfile>();
  copy->filename = filename;
  copy->unit_length = unit_length;
  copy->unit_angle = unit_angle;
  copy->impl_->document = impl_->document;
  copy->impl_->base_directory = impl_->base_directory;
  copy->impl_->asked = impl_->asked;
  copy->impl_->populations = impl_->populations;
  copy->impl_->files = impl_->files;
  copy->impl_->written_count = impl_->written_count;
  copy->impl_->included = impl_->included;
  copy->settings_ = settings_;
  return copy;
}

// ---- entities ----

int Worldfile::GetEntityCount() { return static_cast<int>(impl_->document.entities.size()); }

bool Worldfile::IsCalled(int entity, const std::string& selector) {
  worldfile::Document& document = impl_->document;
  return entity >= 0 && entity < GetEntityCount() &&
         document.IsCalled(static_cast<std::uint32_t>(entity), document.names.Intern(selector));
}

const char* Worldfile::GetEntityType(int entity) {
  if (entity < 0 || entity >= GetEntityCount()) return "";
  return impl_->document.TypeOf(static_cast<std::uint32_t>(entity)).c_str();
}

int Worldfile::GetEntityParent(int entity) {
  if (entity < 0 || entity >= GetEntityCount()) return -1;
  return impl_->document.entities[static_cast<std::size_t>(entity)].parent;
}

int Worldfile::LookupEntity(const char* type) {
  for (int entity = 1; entity < GetEntityCount(); ++entity) {
    if (std::string_view(GetEntityType(entity)) == type) return entity;
  }
  return -1;
}

// ---- properties ----

std::uint32_t Worldfile::Impl::InternAsked(const char* name) {
  const std::uint32_t number = document.names.Intern(name);
  if (asked.size() <= number) asked.resize(number + 1U);
  asked[number] = true;
  return number;
}

std::string_view Worldfile::Impl::Value(int entity, int property, std::size_t index) const {
  const worldfile::Property& from = document.properties[static_cast<std::size_t>(property)];
  if (!written.empty()) {
    const auto found = written.find({static_cast<std::uint32_t>(entity), from.name});
    if (found != written.end() && found->second[index]) return *found->second[index];
  }
  return document.Text(document.tokens[from.first_value + index]);
}

// Index of a property, or -1.
int Worldfile::Find(int entity, const char* name) const {
  const worldfile::Document& document = impl_->document;
  const std::uint32_t number = impl_->InternAsked(name);
  if (entity < 0 || static_cast<std::size_t>(entity) >= document.entities.size()) return -1;
  const std::uint32_t property = document.Find(static_cast<std::uint32_t>(entity), number);
  return property == kNone ? -1 : static_cast<int>(property);
}

// Like Find(), for readers of values: marks the property as used.
int Worldfile::Fetch(int entity, const char* name) {
  const int number = Find(entity, name);
  if (number < 0) return -1;
  worldfile::Property& property = impl_->document.properties[static_cast<std::size_t>(number)];
  property.used = 1;
  if (!impl_->document.overrides.empty()) NoteOverridden(entity, property.name);
  if (!impl_->handles.empty()) {
    const auto handle = impl_->handles.find({static_cast<std::uint32_t>(entity), property.name});
    if (handle != impl_->handles.end()) handle->second->used = true;
  }
  return number;
}

// Records that values before `end` have been read.
void Worldfile::NoteRead(int property, std::size_t end) const {
  std::uint32_t& read = impl_->document.properties[static_cast<std::size_t>(property)].read_end;
  read = std::max(read, static_cast<std::uint32_t>(end));
}

// Marks the overridden property in the file as used.
void Worldfile::NoteOverridden(int entity, unsigned name) {
  worldfile::Document& document = impl_->document;
  const std::uint32_t property = document.FindInFile(static_cast<std::uint32_t>(entity), name);
  if (property != kNone) document.properties[property].used = 1;
}

bool Worldfile::PropertyExists(int entity, const char* name) { return Find(entity, name) >= 0; }

// Marks all values as read: readers that ask for the length accept any number.
std::size_t Worldfile::TupleLength(int entity, const char* name) {
  const int property = Find(entity, name);
  if (property < 0) return 0;
  NoteRead(property, kNone);
  return impl_->document.properties[static_cast<std::size_t>(property)].value_count;
}

CProperty* Worldfile::GetProperty(int entity, const char* name) {
  const int number = Find(entity, name);
  if (number < 0) return nullptr;
  NoteRead(number, kNone);
  const worldfile::Document& document = impl_->document;
  const worldfile::Property& property = document.properties[static_cast<std::size_t>(number)];
  std::unique_ptr<CProperty>& handle =
      impl_->handles[{static_cast<std::uint32_t>(entity), property.name}];
  if (!handle) {
    const worldfile::Place place = document.PlaceOf(document.tokens[property.name_token]);
    handle.reset(new CProperty(entity, name, static_cast<int>(place.line)));
    handle->file = place.file;
    handle->column = static_cast<int>(place.column);
    handle->used = property.used != 0;
    for (std::uint32_t i = 0; i < property.value_count; ++i) {
      handle->values.push_back(static_cast<int>(property.first_value + i));
    }
  }
  return handle.get();
}

const char* Worldfile::GetPropertyValue(CProperty* property, int index) {
  if (property == nullptr || index < 0) return nullptr;
  const int number = Fetch(property->entity, property->name.c_str());
  if (number < 0) return nullptr;
  const auto at = static_cast<std::size_t>(index);
  if (at >= impl_->document.properties[static_cast<std::size_t>(number)].value_count) {
    return nullptr;
  }
  return impl_->kept_strings.emplace(impl_->Value(property->entity, number, at)).first->c_str();
}

// ---- places, warnings ----

std::string Worldfile::Where(int entity, const char* name) const {
  const worldfile::Document& document = impl_->document;
  const int number = Find(entity, name);
  if (number >= 0) {
    const worldfile::Property& property = document.properties[static_cast<std::size_t>(number)];
    return document.PlaceOf(document.tokens[property.first_value]).Text();
  }
  const bool inside = entity > 0 && static_cast<std::size_t>(entity) < document.entities.size();
  const std::uint32_t token =
      inside ? document.entities[static_cast<std::size_t>(entity)].name_token : kNone;
  if (token == kNone) return worldfile::Place{filename.empty() ? "<stream>" : filename}.Text();
  return document.PlaceOf(document.tokens[token]).Text();
}

void Worldfile::Fail(int entity, const char* name, const std::string& message) const {
  throw LoadError(Where(entity, name) + ": " + message);
}

void Worldfile::Warn(int entity, const char* name, const std::string& message) {
  if (!impl_->document.HasAllWarnings()) impl_->document.Warn(Where(entity, name), message);
}

const std::vector<std::string>& Worldfile::warnings() const { return impl_->document.warnings; }

std::vector<UnusedProperty> Worldfile::Unused() const {
  const worldfile::Document& document = impl_->document;
  std::vector<bool> fetched(document.properties.size());
  for (const auto& [slot, handle] : impl_->handles) {
    if (handle->used) fetched[document.Find(slot.first, slot.second)] = true;
  }
  const worldfile::NameAdviser adviser(document, impl_->asked);
  std::vector<UnusedProperty> unused;
  for (const auto& [number, entity] : worldfile::FindUnfetched(document, fetched)) {
    const worldfile::Property& property = document.properties[number];
    const worldfile::Place place = document.PlaceOf(document.tokens[property.name_token]);
    unused.push_back({place.file, static_cast<int>(place.line), static_cast<int>(place.column),
                      document.names.Text(property.name),
                      adviser.SimilarName(entity, property.name), ""});
    unused.back().successor = worldfile::SuccessorOf(unused.back().name, document.TypeOf(entity));
  }
  return unused;
}

std::vector<std::string> Worldfile::AskedNames() const {
  std::vector<std::string> names;
  for (std::uint32_t name = 0; name < impl_->asked.size(); ++name) {
    if (impl_->asked[name]) names.push_back(impl_->document.names.Text(name));
  }
  return names;
}

// An overlong tuple often means that its values are in the wrong order.
void Worldfile::WarnOfLongTuples() {
  const worldfile::Document& document = impl_->document;
  for (std::size_t number = 0; number < document.properties.size(); ++number) {
    const worldfile::Property& property = document.properties[number];
    const std::uint32_t read = property.read_end;
    if (!property.used || read == 0 || read >= property.value_count) continue;
    WarnAt(static_cast<int>(number), read,
           "found " + std::to_string(property.value_count) + " values, expected " +
               std::to_string(read) + "; the rest is not read");
  }
}

bool Worldfile::WarnUnused() {
  const std::vector<UnusedProperty> unused = Unused();
  for (const worldfile::UnusedFamily& family : worldfile::GroupUnused(unused)) {
    const UnusedProperty& property = family.first;
    const worldfile::Place place{property.file, static_cast<std::size_t>(property.line),
                                 static_cast<std::size_t>(property.column)};
    impl_->document.Warn(place.Text(), family.Message());
  }
  WarnOfLongTuples();
  const std::vector<std::string>& lines = warnings();
  for (; impl_->warnings_printed < lines.size(); ++impl_->warnings_printed) {
    messages::Report(LogLevel::kWarning, lines[impl_->warnings_printed]);
  }
  return !unused.empty();
}

}  // namespace Stg
