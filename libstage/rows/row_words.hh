// SPDX-License-Identifier: GPL-2.0-or-later
//
// The state of a row as a sequence of words, for clients that keep thousands of states, compare
// them, and store them in files. The same history gives the same words.

#ifndef STAGE_ROWS_ROW_WORDS_HH
#define STAGE_ROWS_ROW_WORDS_HH

#include <cstddef>
#include <cstdint>

#include "rows/rows.hh"

namespace Stg::rows {

class RowWords {
 public:
  explicit RowWords(const Scene& scene);

  const Scene& scene() const { return scene_; }
  /// A hash of the columns and of the number of elements in each.
  uint64_t layout() const { return layout_; }
  /// Number of words of a world; `reseeded`: of one that World::Reseed() has changed.
  size_t Count(bool reseeded) const { return count_ + (reseeded ? reseeding_count_ : 0); }
  static bool IsReseeded(const Rows& rows, size_t world) {
    return rows.columns.reseeding[world] != nullptr;
  }
  /// Writes Count(IsReseeded(rows, world)) words.
  void Save(const Rows& rows, size_t world, uint64_t* to) const;
  /// Reads words that were saved from rows of a scene with the same layout.
  void Load(const uint64_t* from, bool reseeded, Rows* rows, size_t world) const;

 private:
  const Scene& scene_;
  uint64_t layout_;
  size_t count_ = 0, reseeding_count_, models_;
};

}  // namespace Stg::rows

#endif
