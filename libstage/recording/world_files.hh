// SPDX-License-Identifier: GPL-2.0-or-later
//
// The files that a world was loaded from, to be stored in a log and unpacked from it.

#ifndef STAGE_RECORDING_WORLD_FILES_HH
#define STAGE_RECORDING_WORLD_FILES_HH

#include <string>
#include <vector>

namespace Stg {
class World;
}

namespace Stg::recording {

struct WorldFile {
  std::string name;  ///< relative to a folder that contains all files
  std::string content;
};

/// Returns the world file as it was read, then its includes and images. Empty if no world is
/// loaded. Images that can no longer be read are skipped with a warning.
std::vector<WorldFile> FilesOf(World* world);

/// A temporary folder with these files. The destructor deletes it.
class UnpackedFiles {
 public:
  /// Throws std::runtime_error on failure, or if a name points outside of the folder.
  explicit UnpackedFiles(const std::vector<WorldFile>& files);
  ~UnpackedFiles();
  UnpackedFiles(const UnpackedFiles&) = delete;
  UnpackedFiles& operator=(const UnpackedFiles&) = delete;

  /// Path of the first file.
  const std::string& world_file() const { return world_file_; }
  /// All folders that contain files, separated by `:`, for STAGEPATH.
  const std::string& folders() const { return folders_; }

 private:
  void Unpack(const std::vector<WorldFile>& files);

  std::string folder_, world_file_, folders_;
};

}  // namespace Stg::recording

#endif
