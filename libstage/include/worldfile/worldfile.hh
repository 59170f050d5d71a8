// SPDX-License-Identifier: GPL-2.0-or-later
//
// Worldfile: what the models of a world file read from it. Part of <stage.hh>; C++11.

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

/// A property of one entity, for code that walks properties itself. Owned by the Worldfile.
class CProperty {
 public:
  CProperty(int of_entity, const char* property_name, int at_line)
      : entity(of_entity), name(property_name), line(at_line), column(1), used(false) {}

  int entity;
  std::string name;
  std::vector<int> values;  ///< the numbers of the values' tokens
  std::string file;         ///< where the name stands
  int line;
  int column;
  bool used;  ///< its value has been fetched (setting it counts as fetching)
};

/// A property that nobody asked for.
struct UnusedProperty {
  std::string file;
  int line;
  int column;
  std::string name;
  std::string suggestion;  ///< a similar name that was asked for; empty if there is none
  std::string successor;   ///< what replaces it, if older Stages had it; else empty
};

/// Models that a section `population ( model "TYPE" count N )` of the world asks for, or a setting
/// TYPE=N. They are entities like those that are written out.
struct Population {
  std::string name;          ///< what messages call it
  int entity;                ///< of the section; -1: a setting asked for it
  std::vector<int> members;  ///< entities
};

/// A world file: a tree of numbered entities with properties. Entity 0 is the world; -1 means "no
/// entity". Values are text; whoever reads one decides its type. The readers give the default when
/// the property is absent, take the first element of a tuple, and mark the property as used.
///
/// Mistakes in the file throw Stg::LoadError, whose text is `FILE:LINE:COLUMN: what was found,
/// expected what`: from Load (syntax, missing files), and from the numeric readers (values that
/// are not finite, tuples that are too short). World::Load turns them into its `false`.
///
/// Not safe to use from several threads at once.
class Worldfile {
 public:
  Worldfile();
  ~Worldfile();
  Worldfile(const Worldfile&) = delete;
  Worldfile& operator=(const Worldfile&) = delete;

  /// Values in place of those that are written in the files that are loaded from now on. Each is
  ///   NAME.PROPERTY=VALUE  where NAME is "world", a type or a macro, or the name that a section
  ///   has; NAME=COUNT           so many models of the population of that name. Without one: of the
  ///   type
  ///                        of that name (an s at its end is ignored), in place of those of the
  ///                        type that stand outside of all others.
  /// A value that is no number and no tuple in brackets is a text; quotes around it may be left
  /// out. The last one that fits holds. Load() throws LoadError for one that is none of these.
  void Set(const std::vector<std::string>& settings);
  /// Throws LoadError if there is one that nobody has read so far.
  void CheckSettings() const;
  const std::vector<Population>& populations() const;

  /// Reads a file, which is looked for as given, then in STAGEPATH. Always returns true: what goes
  /// wrong throws LoadError, and then there are no entities but the world.
  bool Load(const std::string& file);
  /// The same from a stream. `file` (may be empty) is only what relative names are relative to.
  bool Load(std::istream& world_content, const std::string& file = std::string());

  /// Writes the world file with the values as they are now, to the file it came from if `file` is
  /// empty. The layout stays; line ends become LF. A value that comes from a macro and is no longer
  /// the macro's is added to the instance. Written to a temporary file first, so that nothing is
  /// ever half written. Returns false, after a message on standard error, if that fails.
  bool Save(const std::string& file);

  /// Prints what Unused() and warnings() tell on standard error, each once, and which tuples have
  /// more values than anybody has read. Properties that differ in an index alone, and those that
  /// several sections have, share a line. True if there were unused properties.
  bool WarnUnused();
  /// The properties that nobody fetched, in file order. One that a macro gives to many entities is
  /// here once, and only if it was fetched for none. A thousand of them at most.
  std::vector<UnusedProperty> Unused() const;
  /// The names of properties that anybody has looked for, whether there were any or not.
  std::vector<std::string> AskedNames() const;

  const std::string ReadString(int entity, const char* name, const std::string& value);
  void WriteString(int entity, const char* name, const std::string& value);
  int ReadInt(int entity, const char* name, int value);
  void WriteInt(int entity, const char* name, int value);
  double ReadFloat(int entity, const char* name, double value);
  void WriteFloat(int entity, const char* name, double value);
  /// In metres.
  double ReadLength(int entity, const char* name, double value);
  void WriteLength(int entity, const char* name, double value);
  /// In radians.
  double ReadAngle(int entity, const char* name, double value);
  /// Completed with the world file's directory. The result stays valid as long as the Worldfile;
  /// `value` comes back as it is.
  const char* ReadFilename(int entity, const char* name, const char* value);

  /// An element of a tuple as text; "" if the property or the element is absent.
  std::string ReadElement(int entity, const char* name, std::size_t index);

  /// Reads `count` elements of a tuple from element `first` on. `format` has a letter for each:
  /// i int*, u unsigned*, f l a double* (plain, length, angle), s char** (gets a new string, to be
  /// freed). Returns `count`, or 0, with nothing changed, if the property is absent.
  int ReadTuple(const int entity, const char* name, const unsigned int first,
                const unsigned int count, const char* format, ...);
  /// Takes values where ReadTuple takes pointers. Writing (here and above) has no effect where the
  /// property or the element is absent.
  void WriteTuple(const int entity, const char* name, const unsigned int first,
                  const unsigned int count, const char* format, ...);

  bool PropertyExists(int entity, const char* name);
  CProperty* GetProperty(int entity, const char* name);
  const char* GetPropertyValue(CProperty* property, int index);
  /// The number of values; 0 if the property is absent.
  std::size_t TupleLength(int entity, const char* name);

  int GetEntityCount();
  /// Whether that is the entity's type, one of its macros, or its name.
  bool IsCalled(int entity, const std::string& selector);
  /// The type at the bottom of the entity's macros; "" for the world.
  const char* GetEntityType(int entity);
  /// -1 for the world.
  int GetEntityParent(int entity);
  /// The first entity of the type, or -1.
  int LookupEntity(const char* type);

  /// "FILE:LINE:COLUMN" of the property's value, or of the entity if it has no such property.
  std::string Where(int entity, const char* name) const;
  /// Throws LoadError: "FILE:LINE:COLUMN: message", with the place that Where tells.
  [[noreturn]] void Fail(int entity, const char* name, const std::string& message) const;
  /// Adds a warning about that place to warnings().
  void Warn(int entity, const char* name, const std::string& message);
  /// One line each, "FILE:LINE:COLUMN: warning: ...".
  const std::vector<std::string>& warnings() const;

  /// Takes back what was written to it since it was read.
  void ForgetWritten();
  /// As it was when it was read, without reading it again.
  std::unique_ptr<Worldfile> Copy() const;

  /// The texts that it was read from: the world file's first, then those of what it includes. The
  /// name is the path that was opened.
  struct Text {
    std::string name, text;
  };
  std::vector<Text> Texts() const;

  /// As given to Load; if the file came from STAGEPATH, the path where it was found.
  std::string filename;
  double unit_length;  ///< metres in one unit of length of the file
  double unit_angle;   ///< radians in one unit of angle of the file

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
