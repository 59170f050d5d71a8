// SPDX-License-Identifier: GPL-2.0-or-later
//
// The files that a world was loaded from, to be kept in a log and unpacked from it.

#ifndef STAGE_RECORDING_WORLD_FILES_HH
#define STAGE_RECORDING_WORLD_FILES_HH

#include <string>
#include <vector>

namespace Stg {
class World;
}

namespace Stg::recording {

struct WorldFile {
  std::string name;  ///< relative to a folder that all of them lie in
  std::string content;
};

/// The world file first, as it was when it was read, then what it includes, and its pictures. Empty
/// if nothing is loaded. Pictures that can't be read any more are left out, with a warning.
std::vector<WorldFile> FilesOf(World* world);

/// A folder of its own with these files in it, which is deleted with it.
class UnpackedFiles {
 public:
  /// Throws std::runtime_error if that fails, or if a name leads out of the folder.
  explicit UnpackedFiles(const std::vector<WorldFile>& files);
  ~UnpackedFiles();
  UnpackedFiles(const UnpackedFiles&) = delete;
  UnpackedFiles& operator=(const UnpackedFiles&) = delete;

  /// The first of the files.
  const std::string& world_file() const { return world_file_; }
  /// All folders that files lie in, for STAGEPATH: with `:` between them.
  const std::string& folders() const { return folders_; }

 private:
  void Unpack(const std::vector<WorldFile>& files);

  std::string folder_, world_file_, folders_;
};

}  // namespace Stg::recording

#endif
