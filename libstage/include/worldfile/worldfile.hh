// SPDX-License-Identifier: GPL-2.0-or-later
//
// Worldfile: the content of a world file, as models read it. Part of <stage.hh>; C++11.

#ifndef STAGE_WORLDFILE_WORLDFILE_HH
#define STAGE_WORLDFILE_WORLDFILE_HH

#include <cstddef>
#include <iosfwd>
#include <memory>
#include <string>
#include <vector>

namespace Stg {

namespace worldfile {
class Expander;
}

/// A property of one entity, for code that iterates over properties. Owned by the Worldfile.
class CProperty {
 public:
  CProperty(int of_entity, const char* property_name, int at_line)
      : entity(of_entity), name(property_name), line(at_line), column(1), used(false) {}

  int entity;
  std::string name;
  std::vector<int> values;  ///< indices of the values' tokens
  std::string file;         ///< place of the name
  int line;
  int column;
  bool used;  ///< its value has been read or set
};

/// A property that no reader asked for.
struct UnusedProperty {
  std::string file;
  int line;
  int column;
  std::string name;
  std::string suggestion;  ///< a similar name that a reader asked for, or ""
  std::string successor;   ///< its replacement if it is from older Stages, or ""
};

/// Models made by a section `population ( model "TYPE" count N )` of the world, or by a setting
/// TYPE=N. They are entities like those written out.
struct Population {
  std::string name;          ///< used in messages
  int entity;                ///< the section; -1: made by a setting
  std::vector<int> members;  ///< entities
};

/// A world file: a tree of numbered entities with properties. Entity 0 is the world; -1 means none.
/// Values are text, which readers convert. Readers return the default if the property is absent,
/// read the first element of a tuple, and mark the property as used.
///
/// Errors in the file throw Stg::LoadError with the text `FILE:LINE:COLUMN: found ..., expected
/// ...`: Load() for syntax errors and missing files, numeric readers for values that are not finite
/// and tuples that are too short. World::Load() then returns false.
///
/// Not thread-safe.
class Worldfile {
 public:
  Worldfile();
  ~Worldfile();
  Worldfile(const Worldfile&) = delete;
  Worldfile& operator=(const Worldfile&) = delete;

  /// Overrides values of files loaded from now on. Settings have two forms:
  ///   NAME.PROPERTY=VALUE  NAME is "world", a type, a macro, or the name that a section has.
  ///   NAME=COUNT  sets the size of the population NAME. If there is none, COUNT models replace
  ///   all top-level models of type NAME, or NAME without a final s.
  /// A VALUE that is neither a number nor a tuple in brackets is a string; its quotes are optional.
  /// The last matching setting applies. Load() throws LoadError for invalid settings.
  void Set(const std::vector<std::string>& settings);
  /// Throws LoadError if a setting has not been used by any reader.
  void CheckSettings() const;
  const std::vector<Population>& populations() const;

  /// Reads a file, searched as given and then in STAGEPATH. Always returns true: errors throw
  /// LoadError and leave only the world entity.
  bool Load(const std::string& file);
  /// Reads a stream. `file` (may be empty) only determines what relative names refer to.
  bool Load(std::istream& world_content, const std::string& file = std::string());

  /// Saves the current values, to the original file if `file` is empty. Keeps the layout; line ends
  /// become LF. A value that differs from its macro's is added to the instance. Writes to a
  /// temporary file first, so the file is never incomplete. Returns false with a message on
  /// failure.
  bool Save(const std::string& file);

  /// Prints warnings() and Unused() on standard error, each once, and warns of tuples with more
  /// values than were read. Properties that differ only in an index, or occur in several sections,
  /// share a line. Returns true if there were unused properties.
  bool WarnUnused();
  /// Properties that no reader fetched, in file order, at most 1000. A macro's property is listed
  /// once, and only if it was fetched for none of its entities.
  std::vector<UnusedProperty> Unused() const;
  /// Names of all properties that readers have looked for, present or not.
  std::vector<std::string> AskedNames() const;

  const std::string ReadString(int entity, const char* name, const std::string& value);
  void WriteString(int entity, const char* name, const std::string& value);
  int ReadInt(int entity, const char* name, int value);
  void WriteInt(int entity, const char* name, int value);
  double ReadFloat(int entity, const char* name, double value);
  void WriteFloat(int entity, const char* name, double value);
  /// Returns metres.
  double ReadLength(int entity, const char* name, double value);
  void WriteLength(int entity, const char* name, double value);
  /// Returns radians.
  double ReadAngle(int entity, const char* name, double value);
  /// Completes the path with the world file's directory. The result is valid as long as the
  /// Worldfile; `value` is returned unchanged.
  const char* ReadFilename(int entity, const char* name, const char* value);

  /// Returns an element of a tuple as text; "" if the property or element is absent.
  std::string ReadElement(int entity, const char* name, std::size_t index);

  /// Reads `count` elements of a tuple, starting at `first`. `format` has a letter per element: i
  /// int*, u unsigned*, f l a double* (plain, length, angle), s char** (new string, to be freed by
  /// the caller). Returns `count`, or 0 without changes if the property is absent.
  int ReadTuple(const int entity, const char* name, const unsigned int first,
                const unsigned int count, const char* format, ...);
  /// Takes values where ReadTuple() takes pointers. All Write functions have no effect if the
  /// property or element is absent.
  void WriteTuple(const int entity, const char* name, const unsigned int first,
                  const unsigned int count, const char* format, ...);

  bool PropertyExists(int entity, const char* name);
  CProperty* GetProperty(int entity, const char* name);
  const char* GetPropertyValue(CProperty* property, int index);
  /// Number of values; 0 if the property is absent.
  std::size_t TupleLength(int entity, const char* name);

  int GetEntityCount();
  /// True if `selector` is the entity's type, one of its macros, or its name.
  bool IsCalled(int entity, const std::string& selector);
  /// Plain type of the entity, with macros expanded; "" for the world.
  const char* GetEntityType(int entity);
  /// -1 for the world.
  int GetEntityParent(int entity);
  /// First entity of the type, or -1.
  int LookupEntity(const char* type);

  /// "FILE:LINE:COLUMN" of the property's value, or of the entity if it lacks the property.
  std::string Where(int entity, const char* name) const;
  /// Throws LoadError "FILE:LINE:COLUMN: message" with the place given by Where().
  [[noreturn]] void Fail(int entity, const char* name, const std::string& message) const;
  /// Adds a warning with that place to warnings().
  void Warn(int entity, const char* name, const std::string& message);
  /// Each is one line, "FILE:LINE:COLUMN: warning: ...".
  const std::vector<std::string>& warnings() const;

  /// Reads a file with definitions of macros after loading; it is searched like an included file.
  /// Reading it again has no effect. Throws LoadError, also if the file has anything else.
  void Include(const std::string& file);
  /// True if a macro has this name.
  bool HasMacro(const std::string& name) const;
  /// Names of the macros of a type, in the order of their definitions.
  std::vector<std::string> MacrosOf(const std::string& type) const;
  /// Adds an entity of this type or macro, with everything that the macro has, to those of the
  /// file. Returns its number, which is followed by those of its descendants. Save() leaves them
  /// out. Throws LoadError.
  int Add(const std::string& type);
  /// Removes entities that Add() has made, from this number on.
  void RemoveAdded(int first);
  /// Number of entities without those that Add() has made.
  int GetWrittenCount() const;

  /// Reverts all written values.
  void ForgetWritten();
  /// Returns a copy in the state after loading, without reading the file again.
  std::unique_ptr<Worldfile> Copy() const;

  /// The texts that were read: the world file, followed by included files. `name` is the path that
  /// was opened.
  struct Text {
    std::string name, text;
  };
  std::vector<Text> Texts() const;

  /// The name given to Load(), or the path where the file was found in STAGEPATH.
  std::string filename;
  double unit_length;  ///< metres per unit of length in the file
  double unit_angle;   ///< radians per unit of angle in the file

 private:
  struct Impl;

  void Reset();
  void Parse();
  void WarnIfEmpty();
  void ReadUnits();
  void ApplySettings();
  bool HasPopulation(const std::string& name);
  void AddPopulations(worldfile::Expander* expander);
  void AddPopulation(int entity, worldfile::Expander* expander);
  void NoteOverridden(int entity, unsigned name);
  int Find(int entity, const char* name) const;
  int Fetch(int entity, const char* name);
  int FetchScalar(int entity, const char* name);
  void NoteRead(int property, std::size_t end) const;
  void WarnOfLongTuples();
  double ReadNumber(int entity, int property, std::size_t index);
  long long ReadInteger(int entity, int property, std::size_t index, long long low, long long high);
  void WriteValue(int entity, const char* name, std::size_t index, const std::string& text,
                  bool valid = true);
  [[noreturn]] void FailAt(int property, std::size_t index, const std::string& message) const;
  void WarnAt(int property, std::size_t index, const std::string& message);

  std::unique_ptr<Impl> impl_;
  std::vector<std::string> settings_;
};

}  // namespace Stg

#endif
