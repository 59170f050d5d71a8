// SPDX-License-Identifier: GPL-2.0-or-later
#ifndef STAGE_WORLDFILE_EXPANDER_HH
#define STAGE_WORLDFILE_EXPANDER_HH

#include <cstddef>
#include <cstdint>
#include <vector>

#include "worldfile/document.hh"

namespace Stg::worldfile {

/// Macro expansion: creates the numbered entities of the world from entities as written. Looks
/// names up among the macros defined so far. Throws LoadError for recursive macros, for errors in
/// macro bodies, and if a limit is exceeded.
class Expander {
 public:
  /// Macros of the document count as defined.
  explicit Expander(Document& document);

  void AddMacro(Macro macro);
  const Macro* FindMacro(std::uint32_t name) const;

  /// Adds an entity of the world, including everything from its macros.
  void Expand(const Child& child);

  /// Warns about unused macros with errors.
  void WarnOfUnusedErrors();

 private:
  void NoteMacro(std::uint32_t name, std::uint32_t number);
  void ExpandUnder(const Child& child, std::uint32_t parent, std::size_t depth);
  void ExpandChildren(std::uint32_t body, std::uint32_t parent, std::size_t depth);
  void CheckLimits(const Child& child, std::size_t depth) const;
  void CheckUsable(const Chain& chain, const Child& child) const;
  std::uint32_t ResolveChain(const Child& child);
  std::uint32_t PlainChain(std::uint32_t type);
  Chain WalkBases(std::uint32_t macro, const Child& child) const;
  [[noreturn]] void FailRecursive(std::uint32_t macro, const Child& child) const;
  std::uint32_t MacroNumber(std::uint32_t name) const;

  Document& document_;
  std::vector<std::uint32_t> macro_of_name_;
  std::vector<std::uint32_t> plain_chain_of_name_;
  const Child* outermost_ = nullptr;
};

}  // namespace Stg::worldfile

#endif
