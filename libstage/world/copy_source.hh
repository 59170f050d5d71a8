// SPDX-License-Identifier: GPL-2.0-or-later
//
// Copies of a world that are stepped side by side: branches, batches and forks.

#ifndef STAGE_WORLD_COPY_SOURCE_HH
#define STAGE_WORLD_COPY_SOURCE_HH

#include <memory>

#include "world/world.hh"

namespace Stg {

/// Makes copies of a loaded world, as it was after loading. The world may be stepped, changed or
/// deleted afterwards.
class CopySource {
 public:
  /// Is empty, after a message, if no world is loaded. `share_device`: the copies use the OpenCL
  /// device of the world, if it has one.
  CopySource(const World& original, bool share_device);

  bool empty() const { return !image_; }
  /// Options of the world for copies: one thread, unlisted, and without a device of their own.
  const RunOptions& options() const { return options_; }
  /// Loads a copy. Several threads may call it at once. Returns null, after a message, if loading
  /// fails or a controller deletes the copy; throws std::bad_alloc.
  std::unique_ptr<World> Make(const RunOptions& options) const;

 private:
  std::shared_ptr<const WorldImage> image_;
  RunOptions options_;
  std::shared_ptr<const World> device_;  // never loaded; keeps the device; null: no device
};

}  // namespace Stg

#endif
